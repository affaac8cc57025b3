/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The RTL is clocked up to the next event and stops behind each clock that changes an output. How far that is the twin's own
 * model of the PWM tells, filled in from the RTL's registers: only a promise, on which the RTL decides. One that it breaks ends
 * the run, for the physics would have come too late. */
#include "fabric_rtl.h"

#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "converter.h"
#include "lines.h"
#include "pwm.h"
#include "rtl_axis.h"

#define EVENTS_ROOM     256 /* a power of two */
#define RESET_CLOCKS    2
#define CONVERSION      40    /* clocks from the trigger to the results */
#define CHOPPER_OLD     65537 /* clocks from the results on */
#define STOP_CLOCKS     4
#define ADC_CONTROL     0x100u
#define ENC_FILTER      0x220u
#define GATE_ID         0x308u
#define ADC_ENABLE      1u
#define ENC_FILTER_BITS 0xFFu

/* The wires behind a clock that changed one of them. */
struct change {
    int64_t clock;
    unsigned gates;
    bool live, chops, interrupt, triggered, converted;
};

struct fabric_rtl {
    struct fabric fabric;
    const struct rtl_axis_calls *calls;
    struct rtl_axis *axis;
    int64_t clock;
    struct rtl_inputs in;
    struct rtl_outputs out;
    struct pwm promise;
    bool promised; /* since nothing has happened to the RTL */
    struct change event[EVENTS_ROOM];
    unsigned first, count;
    struct converter converter[4], thermometer;
    uint32_t code[4];
    bool enabled;
    int64_t finish;                  /* the clock in which a conversion ends; INT64_MAX: none runs */
    int64_t sampled_at, chopper_due; /* of the chopper: its newest sample, and when it may follow it */
    int64_t stops_until;             /* pins that stop are on their way to the latches */
    struct lines lines;
    uint32_t id_xor;
};

static struct fabric_rtl *rtl(struct fabric *f)
{
    return (struct fabric_rtl *)f;
}

static const struct fabric_rtl *looked_at(const struct fabric *f)
{
    return (const struct fabric_rtl *)f;
}

static int64_t lesser(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

static sim_ps time_of(int64_t clock)
{
    return clock == INT64_MAX ? SIM_NEVER : clock * SIM_PS_PER_FABRIC_CLOCK;
}

__attribute__((noreturn)) static void fail(const char *what, const char *why)
{
    fprintf(stderr, "mssfoc twin: %s: %s\n", what, why);
    exit(1);
}

/* ---- what the outputs say ---- */

static unsigned gates_of(const struct rtl_outputs *out)
{
    unsigned gates = 0;
    for (int k = 0; k < 3; k++) {
        gates |= ((out->high >> k) & 1u) << (2 * k) | ((out->low >> k) & 1u) << (2 * k + 1);
    }
    return gates;
}

static void follow_converters(struct fabric_rtl *r)
{
    unsigned data = 0;
    for (int k = 0; k < 4; k++) {
        r->converter[k].code = r->code[k];
        data |= converter_follow(&r->converter[k], AD7356_ZEROS, r->out.cs_n, r->out.sclk) ? 1u << k : 0u;
    }
    r->in.sdata = (uint8_t)data;
    r->in.temp_sdata = converter_follow(&r->thermometer, AD7476A_ZEROS, r->out.temp_cs_n, r->out.temp_sclk);
}

static void note(struct fabric_rtl *r, const struct change *c)
{
    if (r->count == EVENTS_ROOM) {
        fail("FABRIC=rtl", "more happens at the RTL's pins than the twin can follow");
    }
    r->event[(r->first + r->count++) % EVENTS_ROOM] = *c;
}

/* The newest wires that have been noted, or else those the plant knows. */
static void look(struct fabric_rtl *r)
{
    const struct fabric *f = &r->fabric;
    const struct change *last = r->count ? &r->event[(r->first + r->count - 1) % EVENTS_ROOM] : NULL;
    struct change before = last ? *last : (struct change){0, f->gates, f->live, f->chops, f->interrupt, false, false};
    struct change now = {r->clock, gates_of(&r->out), r->out.live, r->out.chopper, r->out.irq, r->out.trigger, false};
    if (r->clock == r->finish + 1) {
        now.converted = true;
        r->finish = INT64_MAX;
    }
    if (now.triggered || now.converted || now.gates != before.gates || now.live != before.live ||
        now.chops != before.chops || now.interrupt != before.interrupt) {
        note(r, &now);
    }
    follow_converters(r);
}

static void settle(struct fabric_rtl *r)
{
    r->calls->settle(r->axis, &r->in, &r->out);
    follow_converters(r);
    r->calls->settle(r->axis, &r->in, &r->out);
    r->promised = false;
}

/* ---- clocks ---- */

static void take_lines(struct fabric_rtl *r)
{
    while (lines_next(&r->lines) <= r->clock) {
        struct line_state s = lines_take(&r->lines);
        r->in.a = s.a;
        r->in.b = s.b;
        r->in.index = s.index;
        r->in.lost = s.lost;
        r->in.hall = s.hall;
    }
}

/* Up to clock `to`, but not beyond a change of the wires that the plant has to see. */
static void clock_to(struct fabric_rtl *r, int64_t to)
{
    while (r->clock < to && r->count == 0) {
        take_lines(r);
        r->calls->settle(r->axis, &r->in, &r->out);
        int64_t until = lesser(to, lesser(lines_next(&r->lines), r->finish == INT64_MAX ? INT64_MAX : r->finish + 1));
        until = until > r->clock ? until : r->clock + 1;
        r->clock += (int64_t)r->calls->run(r->axis, (uint64_t)(until - r->clock), &r->out);
        look(r);
    }
}

/* One clock of the bus, whatever happens in it. */
static void bus_clock(struct fabric_rtl *r)
{
    take_lines(r);
    settle(r);
    r->clock += (int64_t)r->calls->run(r->axis, 1, &r->out);
    look(r);
}

static uint32_t transfer(struct fabric_rtl *r, bool writes, uint32_t offset, uint32_t value)
{
    r->in.psel = true;
    r->in.penable = false;
    r->in.pwrite = writes;
    r->in.paddr = (uint16_t)offset;
    r->in.pwdata = value;
    bus_clock(r);
    r->in.penable = true;
    uint32_t read = r->out.prdata;
    bus_clock(r);
    r->in.psel = r->in.penable = false;
    settle(r);
    r->fabric.ahead = time_of(r->clock);
    return read;
}

/* ---- how long nothing is decided ---- */

static void fill_promise(struct fabric_rtl *r)
{
    struct rtl_pwm look;
    struct pwm *p = &r->promise;
    r->calls->look(r->axis, &look);
    *p = (struct pwm){.control = look.control,
                      .period = look.period,
                      .dead = look.dead,
                      .min_pulse = look.min_pulse,
                      .mode = look.mode,
                      .phase = look.phase,
                      .trigger = {look.trigger[0], look.trigger[1]},
                      .fresh = look.fresh,
                      .running = look.running,
                      .rising = look.rising,
                      .count = look.count,
                      .live = r->out.live,
                      .clock = r->clock,
                      .rested_at = r->clock - 1};
    for (int k = 0; k < 3; k++) {
        p->compare[k] = (struct pwm_compare){look.newest[k], look.compare[k], look.waiting[k], false};
        p->leg[k] = (struct pwm_leg){look.side[k], look.on[k], look.left[k]};
    }
    pwm_plan(p);
    r->promised = true;
    if (p->running && p->count == p->period && !p->rising) {
        r->fabric.valley_at = time_of(r->clock);
    }
}

static const struct pwm *promise(struct fabric_rtl *r)
{
    if (!r->promised) {
        fill_promise(r);
    }
    return &r->promise;
}

/* What is decided beside the PWM: an overrun in the clock that ends a conversion, its results behind it, the chopper behind
 * these or when they are old, and pins that stop, behind their flip-flops. */
static int64_t next_beside_pwm(const struct fabric_rtl *r)
{
    int64_t next = r->chopper_due;
    if (r->finish != INT64_MAX) {
        next = lesser(next, r->finish > r->clock ? r->finish : r->finish + 1);
    }
    if (r->fabric.chops) {
        next = lesser(next, r->sampled_at + CHOPPER_OLD);
    }
    return r->clock < r->stops_until ? r->clock + 1 : next;
}

static sim_ps next_event(struct fabric *f)
{
    struct fabric_rtl *r = rtl(f);
    if (r->count) {
        return time_of(r->event[r->first].clock);
    }
    int64_t next = lesser(promise(r)->next_clock, next_beside_pwm(r));
    return time_of(next > r->clock ? next : r->clock + 1);
}

static bool needs_physics(struct fabric *f)
{
    (void)f;
    return true;
}

static void show(struct fabric_rtl *r, const struct change *c)
{
    r->fabric.gates = c->gates;
    r->fabric.live = c->live;
    r->fabric.chops = c->chops;
    r->fabric.interrupt = c->interrupt;
}

static unsigned take_noted(struct fabric_rtl *r)
{
    struct change c = r->event[r->first];
    r->first = (r->first + 1) % EVENTS_ROOM;
    r->count--;
    show(r, &c);
    if (c.converted) {
        r->sampled_at = c.clock;
        r->chopper_due = c.clock + 1;
    }
    return (c.triggered ? FABRIC_TRIGGERED : 0u) | (c.converted ? FABRIC_CONVERTED : 0u);
}

static void clock_as_promised(struct fabric_rtl *r, int64_t to)
{
    clock_to(r, to);
    if (r->clock < to) {
        char what[80];
        snprintf(what, sizeof what, "FABRIC=rtl: clock %lld", (long long)r->clock);
        fail(what,
             "the RTL decided something before the model of its PWM expects it; make lockstep tells where they differ");
    }
}

static unsigned take_event(struct fabric *f)
{
    struct fabric_rtl *r = rtl(f);
    if (r->count == 0) {
        int64_t due = next_event(f) / SIM_PS_PER_FABRIC_CLOCK;
        r->chopper_due = r->chopper_due <= due ? INT64_MAX : r->chopper_due;
        clock_as_promised(r, due);
        r->promised = false;
    }
    return r->count ? take_noted(r) : 0;
}

static void catch_up(struct fabric *f, sim_ps now)
{
    clock_as_promised(rtl(f), now / SIM_PS_PER_FABRIC_CLOCK);
}

static sim_ps next_trigger(struct fabric *f)
{
    return pwm_next_trigger(promise(rtl(f)));
}

static sim_ps next_conversion_end(struct fabric *f)
{
    const struct fabric_rtl *r = rtl(f);
    if (r->finish != INT64_MAX) {
        return time_of(r->finish + 1);
    }
    sim_ps trigger_at = next_trigger(f);
    return !r->enabled || trigger_at == SIM_NEVER ? SIM_NEVER : trigger_at + time_of(CONVERSION);
}

/* ---- registers ---- */

static void reset(struct fabric *f, sim_ps now)
{
    struct fabric_rtl *r = rtl(f);
    r->in.rst_n = false;
    r->clock = now / SIM_PS_PER_FABRIC_CLOCK - RESET_CLOCKS;
    r->finish = r->chopper_due = INT64_MAX;
    r->stops_until = 0;
    r->first = r->count = 0;
    r->enabled = false;
    r->lines.filter = 0;
    for (int n = 0; n < RESET_CLOCKS; n++) {
        bus_clock(r);
    }
    r->in.rst_n = true;
    settle(r);
    r->first = r->count = 0;
    show(r, &(struct change){.live = r->out.live});
}

static uint32_t read(struct fabric *f, uint32_t offset, sim_ps now)
{
    struct fabric_rtl *r = rtl(f);
    catch_up(f, now);
    uint32_t value = transfer(r, false, offset, 0);
    return offset == GATE_ID ? value ^ r->id_xor : value;
}

static void write(struct fabric *f, uint32_t offset, uint32_t value, sim_ps now)
{
    struct fabric_rtl *r = rtl(f);
    catch_up(f, now);
    transfer(r, true, offset, value);
    if (offset == ADC_CONTROL) {
        r->enabled = value & ADC_ENABLE;
        r->finish = r->enabled ? r->finish : INT64_MAX;
    } else if (offset == ENC_FILTER) {
        r->lines.filter = value & ENC_FILTER_BITS;
    }
}

/* ---- converters ---- */

static bool converting(const struct fabric *f)
{
    return looked_at(f)->finish != INT64_MAX;
}

static bool listens(const struct fabric *f)
{
    return looked_at(f)->enabled && !converting(f);
}

/* CS falls in the clock after the trigger, and may have fallen already if the bus was busy meanwhile. */
static void convert(struct fabric *f, const uint32_t code[4], sim_ps now)
{
    struct fabric_rtl *r = rtl(f);
    memcpy(r->code, code, sizeof r->code);
    r->finish = now / SIM_PS_PER_FABRIC_CLOCK + CONVERSION - 1;
    settle(r);
}

static void sample(struct fabric *f, int channel, uint32_t code)
{
    struct fabric_rtl *r = rtl(f);
    if (r->converter[channel].falls > AD7356_ZEROS) {
        fail("FABRIC=rtl",
             "sensor.skew_b_s or skew_c_s is later than the converter's first bit, 50 ns behind the trigger; "
             "less skew, or FABRIC=model, works");
    }
    r->code[channel] = code;
    settle(r);
}

/* The converter's code at the divider of a PT1000 below 2200 ohms: the inverse of drivers/fabric/rtl/adc_curve.v. */
static void sense(struct fabric *f, uint32_t code)
{
    double c = ((double)code - 800) / 16, ohm = 1000 * (1 + 3.9083e-3 * c - 5.775e-7 * c * c);
    rtl(f)->thermometer.code = code == 0 ? 0 : (uint32_t)lround(4096 * ohm / (ohm + 2200));
}

/* ---- pins ---- */

static void stop(struct fabric *f, enum gate_latch which, bool stops, sim_ps now)
{
    struct fabric_rtl *r = rtl(f);
    catch_up(f, now);
    if (which == GATE_OVERCURRENT) {
        r->in.overcurrent = stops;
    } else if (which == GATE_DRIVER_FAULT) {
        r->in.driver_fault = stops;
    } else if (which == GATE_STO_A) {
        r->in.sto_a_n = !stops;
    } else if (which == GATE_STO_B) {
        r->in.sto_b_n = !stops;
    } else {
        r->in.clock_ok = !stops;
    }
    settle(r);
    look(r);
    r->stops_until = r->clock + STOP_CLOCKS;
    if (r->count == 1) { /* at once; behind others it waits for its turn */
        show(r, &r->event[r->first]);
    }
}

static void turn(struct fabric *f, const struct shaft_way *way, const struct index_pulse *pulse)
{
    lines_turn(&rtl(f)->lines, way, pulse, rtl(f)->clock);
}

static void show_hall(struct fabric *f, unsigned state, double changed_ps)
{
    lines_show_hall(&rtl(f)->lines, state, changed_ps, rtl(f)->clock);
}

static void disturb_cable(struct fabric *f, enum cable_fault fault, int64_t value)
{
    lines_disturb(&rtl(f)->lines, fault, value, rtl(f)->clock);
}

static void disguise(struct fabric *f, bool other)
{
    rtl(f)->id_xor = other ? 1u : 0u;
}

static const struct rtl_axis_calls *load(const char *path)
{
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        fail("FABRIC=rtl", dlerror());
    }
    const struct rtl_axis_calls *(*open)(void);
    *(void **)&open = dlsym(library, "rtl_axis_open");
    if (!open || open()->version != RTL_AXIS_VERSION) {
        fail("FABRIC=rtl", "the library of the RTL is not this twin's: run make again");
    }
    return open();
}

struct fabric *fabric_rtl_open(const char *path)
{
    static const struct fabric_ops ops = {
        reset,   read,    write,  next_event, needs_physics, take_event, catch_up, next_trigger, next_conversion_end,
        listens, convert, sample, converting, sense,         stop,       turn,     show_hall,    disturb_cable,
        disguise};
    struct fabric_rtl *r = calloc(1, sizeof *r);
    if (!r) {
        fail("FABRIC=rtl", "out of memory");
    }
    r->fabric.ops = &ops;
    r->fabric.prompt = true;
    r->calls = load(path);
    r->axis = r->calls->create();
    r->in.sto_a_n = r->in.sto_b_n = r->in.clock_ok = true;
    return &r->fabric;
}

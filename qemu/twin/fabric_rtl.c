/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The RTL is clocked up to the next event and stops behind each clock that changes an output. One that comes before it is
 * promised (rtl_ahead.c) ends the run, for the physics would have come too late. */
#include "fabric_rtl.h"

#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "rtl_parts.h"

#define RESET_CLOCKS    2
#define CONVERSION      40 /* clocks from the trigger to the results of the converters */
#define ADC_CONTROL     0x100u
#define ENC_FILTER      0x220u
#define GATE_ID         0x308u
#define ADC_ENABLE      1u
#define ENC_FILTER_BITS 0xFFu

static const struct fabric_rtl *looked_at(const struct fabric *f)
{
    return (const struct fabric_rtl *)f;
}

void rtl_fail(const char *what, const char *why)
{
    fprintf(stderr, "mssfoc twin: %s: %s\n", what, why);
    exit(1);
}

/* ---- events ---- */

static sim_ps next_event(struct fabric *f)
{
    return rtl_time_of(rtl_next_clock(rtl_of(f)));
}

static bool needs_physics(struct fabric *f)
{
    (void)f;
    return true;
}

static void show(struct fabric_rtl *r, const struct rtl_change *c)
{
    r->fabric.gates = c->gates;
    r->fabric.live = c->live;
    r->fabric.chops = c->chops;
    r->fabric.interrupt = c->interrupt;
}

static unsigned take_noted(struct fabric_rtl *r)
{
    struct rtl_change c = r->event[r->first];
    r->first = (r->first + 1) % RTL_EVENTS_ROOM;
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
    rtl_clock_to(r, to);
    if (r->clock < to) {
        char what[80];
        snprintf(what, sizeof what, "FABRIC=rtl: clock %lld", (long long)r->clock);
        rtl_fail(
            what,
            "the RTL decided something before the model of its PWM expects it; make lockstep tells where they differ");
    }
}

static unsigned take_event(struct fabric *f)
{
    struct fabric_rtl *r = rtl_of(f);
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
    clock_as_promised(rtl_of(f), now / SIM_PS_PER_FABRIC_CLOCK);
}

static sim_ps next_trigger(struct fabric *f)
{
    return pwm_next_trigger(rtl_promise(rtl_of(f)));
}

static sim_ps next_conversion_end(struct fabric *f)
{
    const struct fabric_rtl *r = rtl_of(f);
    if (r->finish != INT64_MAX) {
        return rtl_time_of(r->finish + 1);
    }
    sim_ps trigger_at = next_trigger(f);
    return !r->enabled || trigger_at == SIM_NEVER ? SIM_NEVER : trigger_at + rtl_time_of(CONVERSION);
}

/* ---- registers ---- */

static void reset(struct fabric *f, sim_ps now)
{
    struct fabric_rtl *r = rtl_of(f);
    r->in.rst_n = false;
    r->clock = now / SIM_PS_PER_FABRIC_CLOCK - RESET_CLOCKS;
    r->finish = r->chopper_due = INT64_MAX;
    r->stops_until = 0;
    r->tripped = false;
    r->first = r->count = 0;
    r->enabled = false;
    r->lines.filter = 0;
    for (int n = 0; n < RESET_CLOCKS; n++) {
        rtl_reset_clock(r);
    }
    r->in.rst_n = true;
    rtl_settle(r);
    r->first = r->count = 0;
    show(r, &(struct rtl_change){.live = r->out.live});
}

static uint32_t read(struct fabric *f, uint32_t offset, sim_ps now)
{
    struct fabric_rtl *r = rtl_of(f);
    catch_up(f, now);
    uint32_t value = rtl_transfer(r, false, offset, 0);
    return offset == GATE_ID ? value ^ r->id_xor : value;
}

static void write(struct fabric *f, uint32_t offset, uint32_t value, sim_ps now)
{
    struct fabric_rtl *r = rtl_of(f);
    catch_up(f, now);
    rtl_transfer(r, true, offset, value);
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

/* With modulators nothing is fitted at the converters' inputs for currents. */
static void take_codes(struct fabric_rtl *r, const uint32_t code[4])
{
    for (int k = 0; k < 4; k++) {
        r->code[k] = r->modulated && k < 3 ? 0 : code[k];
    }
}

/* CS falls in the clock after the trigger, and may have fallen already if the bus was busy meanwhile. */
static void convert(struct fabric *f, const uint32_t code[4], sim_ps now)
{
    struct fabric_rtl *r = rtl_of(f);
    take_codes(r, code);
    r->finish = now / SIM_PS_PER_FABRIC_CLOCK + CONVERSION - 1;
    rtl_settle(r);
    rtl_expect_results(r);
}

static void sample(struct fabric *f, int channel, uint32_t code)
{
    struct fabric_rtl *r = rtl_of(f);
    if (r->modulated) {
        return;
    }
    if (r->converter[channel].falls > AD7356_ZEROS) {
        rtl_fail("FABRIC=rtl",
                 "sensor.skew_b_s or skew_c_s is later than the converter's first bit, 50 ns behind the trigger; "
                 "less skew, or FABRIC=model, works");
    }
    r->code[channel] = code;
    rtl_settle(r);
}

/* The converter's code at the divider of a PT1000 below 2200 ohms: the inverse of drivers/fabric/rtl/adc_curve.v. */
static void sense(struct fabric *f, uint32_t code)
{
    double c = ((double)code - 800) / 16, ohm = 1000 * (1 + 3.9083e-3 * c - 5.775e-7 * c * c);
    rtl_of(f)->thermometer.code = code == 0 ? 0 : (uint32_t)lround(4096 * ohm / (ohm + 2200));
}

static void modulate(struct fabric *f, const struct stretch *seen)
{
    bit_streams_follow(&rtl_of(f)->bits, seen);
}

/* ---- pins ---- */

static void stop(struct fabric *f, enum gate_latch which, bool stops, sim_ps now)
{
    struct fabric_rtl *r = rtl_of(f);
    catch_up(f, now);
    if (which == GATE_OVERCURRENT) {
        r->in.pin_overcurrent = stops;
    } else if (which == GATE_DRIVER_FAULT) {
        r->in.pin_driver_fault = stops;
    } else if (which == GATE_STO_A) {
        r->in.pin_sto_a_n = !stops;
    } else if (which == GATE_STO_B) {
        r->in.pin_sto_b_n = !stops;
    } else {
        r->in.pin_clock_ok = !stops;
    }
    rtl_settle(r);
    rtl_look(r);
    r->stops_until = r->clock + RTL_STOP_CLOCKS;
    if (r->count == 1) { /* at once; behind others it waits for its turn */
        show(r, &r->event[r->first]);
    }
}

static void turn(struct fabric *f, const struct shaft_way *way, const struct index_pulse *pulse)
{
    lines_turn(&rtl_of(f)->lines, way, pulse, rtl_of(f)->clock);
}

static void show_hall(struct fabric *f, unsigned state, double changed_ps)
{
    lines_show_hall(&rtl_of(f)->lines, state, changed_ps, rtl_of(f)->clock);
}

static void disturb_cable(struct fabric *f, enum cable_fault fault, int64_t value)
{
    lines_disturb(&rtl_of(f)->lines, fault, value, rtl_of(f)->clock);
}

static void disguise(struct fabric *f, bool other)
{
    rtl_of(f)->id_xor = other ? 1u : 0u;
}

/* The verilated axis is the only one of its fabric. */
static bool waits(const struct fabric *f)
{
    (void)f;
    return false;
}

static const struct rtl_axis_calls *load(const char *path)
{
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        rtl_fail("FABRIC=rtl", dlerror());
    }
    const struct rtl_axis_calls *(*open)(void);
    *(void **)&open = dlsym(library, "rtl_axis_open");
    if (!open || open()->version != RTL_AXIS_VERSION) {
        rtl_fail("FABRIC=rtl", "the library of the RTL is not this twin's: run make again");
    }
    return open();
}

struct fabric *fabric_rtl_open(const char *path, const struct sensor_params *sensors, bool in_en, uint64_t seed)
{
    static const struct fabric_ops ops = {reset,         read,          write,
                                          next_event,    needs_physics, take_event,
                                          catch_up,      next_trigger,  next_conversion_end,
                                          listens,       convert,       sample,
                                          converting,    sense,         modulate,
                                          stop,          turn,          show_hall,
                                          disturb_cable, disguise,      waits};
    struct fabric_rtl *r = calloc(1, sizeof *r);
    if (!r) {
        rtl_fail("FABRIC=rtl", "out of memory");
    }
    r->fabric.ops = &ops;
    r->fabric.prompt = true;
    r->calls = load(path);
    if (r->calls->in_en != in_en) {
        rtl_fail("FABRIC=rtl", "inverter.in_en and the library are of different drivers");
    }
    r->axis = r->calls->create();
    r->in.pin_sto_a_n = r->in.pin_sto_b_n = r->in.pin_clock_ok = true;
    r->modulated = sensors->modulators != 0;
    bit_streams_init(&r->bits, sensors->modulator_noise, seed);
    if (r->modulated) {
        rtl_attach(r);
    }
    return &r->fabric;
}

// SPDX-License-Identifier: MIT
/* The twin's C models of one axis beside the verilated fabric_axis: the same random bus traffic and pins, every output compared
 * in every clock, every value read compared. docs/fabric3.md says what is compared and what is not.
 *
 *   lockstep SEED CLOCKS COVERAGE-FILE
 *
 * In clock n the RTL is in state n and sees the inputs of clock n. A write whose access phase is clock n makes state n + 1; the
 * models take what happens at n + 1, then the write. */
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "Vfabric_axis.h"
#include "verilated.h"
#include "verilated_cov.h"

extern "C" {
#include "converter.h"
#include "fabric_model.h"
}
#include "leader.h"
#include "lines.h"
#include "random.h"
#include "traffic.h"

#ifndef AXIS
#define AXIS 0 /* of the RTL; another than 0 follows the carrier of axis 0, and drives inputs and enables */
#endif
#define IN_EN (AXIS != 0)
#ifndef STO_TEST
#error as the RTL has them: STO_TEST, STO_APART
#endif

namespace
{
enum {
    CONVERSION = 40,
    FRAME = 28,
    TEMP_FRAME = 128,
    TEMP_READY = 129, /* the last falling edge, and three clocks of the curve */
    MATH = 13,
    SETTLES = 4,
    RUN_CLOCKS = 20000,
    DOZING_CLOCKS = 90000
};
enum { SLOT = 0x300, ADC_SLOT = 0x100, ENC_SLOT = 0x200, GATE_SLOT = 0x300 };
enum { ADC_STATUS = 0x104, ENC_COUNTS = 0x204, ENC_STATUS = 0x214, ENC_HALL = 0x224, GATE_STATUS = 0x304 };
enum { EOC = 1, PWM_CONTROL = 0x00, FOLLOW = 4, PWM_PHASE = 0x18 };

constexpr sim_ps CLOCK_PS = SIM_PS_PER_FABRIC_CLOCK;

struct tally {
    int64_t clocks, reads, writes, conversions, overruns, stops, edges, gate_changes, chops, missed, unanswered,
        followed, tests, asked, apart;
    bool read[0x100], written[0x100]; /* words of the window */
};

enum bus_phase { IDLE, SETUP, ACCESS };

/* One run from a reset on. */
class run
{
  public:
    run(Vfabric_axis &rtl, uint64_t seed, tally &t)
        : top(rtl), random(seed), how(any_manner(random)), count(t), f(&model.fabric), led(how.period)
    {
        wind.gap = random.one_in(3) ? 4 : 60;
        sto_changes[0] = sto_changes[1] = random.one_in(3) ? 1 + random.below(4000) : -1; /* in a third of the runs */
        temperature = random.one_in(2) ? 1280 : 1312; /* codes at the start of a chord: TEMP 800 and 951 */
        fabric_model_init(&model, CONVERSION * CLOCK_PS, IN_EN);
        model.sto.longest = STO_TEST;
        model.sto.patience = STO_APART;
        if (AXIS != 0) {
            fabric_model_join(&model, AXIS, AXIS + 1, led.model());
        }
        f->ops->reset(f, 0);
    }
    bool play();

  private:
    Vfabric_axis &top;
    random_source random;
    manner how;
    tally &count;
    fabric_model model;
    fabric *f;
    leader led;

    int64_t n = 0; /* clock */
    bus_phase phase = IDLE;
    bool rested = true; /* nothing was selected in the clock before */
    bus_access now = {};
    uint32_t expected = 0, idle_for = 0;
    unsigned set_up = 0;

    int64_t frame_from = -1, frame_to = -1, finish = -1, temp_from = -1, temp_ready = -1, settled_at = 0,
            triggered_at = -1, results_at = -1;
    bool chopped = false;
    uint32_t sampled[4] = {}, temperature = 0;
    converter line_of[4] = {}, thermometer = {};
    unsigned stops = 0; /* bit per pin */
    bool sto_low[2] = {};
    int64_t sto_changes[2];

    shaft wind;
    line a, b, z, hall[3];
    bool a_was = false, b_was = false, z_was = false, lost[2] = {};
    int64_t decoded = 0;

    bool quiet_adc() const;
    uint32_t next_proof() const;
    bool valley_is_near() const;
    bool allowed(const bus_access &x) const;
    void follow(bus_access *x);
    void drive_bus();
    void drive_stops();
    void drive_sto();
    void drive_lines();
    void drive_converters();
    bool differs(const char *what, uint32_t rtl, uint32_t model_says) const;
    bool compare();
    void turn_model(int step, bool indexes);
    void index_without_edge();
    void follow_lines();
    void take_events();
    void write(int turn);
    unsigned hall_levels() const;
};

const unsigned latch_of[] = {GATE_OVERCURRENT, GATE_DRIVER_FAULT, GATE_CLOCK_LOST};

/* ---- inputs ---- */

/* No conversion is in the steps of its arithmetic, which use each setting at another clock. */
bool run::quiet_adc() const
{
    return finish < 0 || n + 1 < finish - MATH;
}

/* What the models do not claim: see the page. Asked for the setup phase; the access is a clock later. */
bool run::allowed(const bus_access &x) const
{
    uint32_t slot = x.offset & SLOT;
    if (slot == GATE_SLOT) {
        return n >= settled_at && n != results_at && n != finish && n + 1 != finish;
    }
    if (!x.writes && slot == ENC_SLOT) {
        return n != triggered_at;
    }
    if (x.writes && slot == ADC_SLOT && x.offset != ADC_STATUS) {
        return quiet_adc();
    }
    if (x.writes && x.offset == ENC_COUNTS) {
        return !z.will_rise((uint8_t)model.encoder.filter);
    }
    return true;
}

uint32_t run::next_proof() const
{
    return (model.gate.watch.thread ? 0xA5E83C00u : 0x5A17C300u) + model.gate.watch.number;
}

/* The watch asks there whether the bridge is on, which a pin that stops ends in the RTL some clocks later. */
bool run::valley_is_near() const
{
    const pwm &p = model.pwm;
    return model.gate.watch.started && p.running && p.rising && p.count + SETTLES + 2 >= p.period;
}

/* What concerns following is written more often, where there is an axis to follow. */
void run::follow(bus_access *x)
{
    if (x->writes && x->offset == PWM_CONTROL && random.below(4) != 0) {
        x->value |= FOLLOW;
    } else if (x->writes && x->offset == PWM_PHASE) {
        x->value = random.below(how.period + 2) | random.below(2) << 16;
    }
}

void run::drive_bus()
{
    rested = phase == IDLE;
    if (phase == SETUP) {
        phase = ACCESS;
    } else if (idle_for > 0) {
        idle_for--;
        phase = IDLE;
    } else {
        bus_access x;
        if (!first_access(random, how, set_up, &x)) {
            x = any_access(random, how, next_proof());
        }
        if (AXIS != 0) {
            follow(&x);
        }
        phase = allowed(x) ? SETUP : IDLE;
        if (phase == SETUP) {
            set_up++;
            now = x;
            idle_for = rest_after(random, how, set_up);
        }
    }
    top.psel = phase != IDLE;
    top.penable = phase == ACCESS;
    top.pwrite = now.writes;
    top.paddr = (uint16_t)now.offset;
    top.pwdata = now.value;
    if (phase == SETUP && !now.writes) {
        expected = f->ops->read(f, now.offset, n * CLOCK_PS);
        expected = now.offset == ENC_HALL ? (expected & 7) | hall_levels() << 4 : expected;
        count.reads++;
        count.read[now.offset / 4] = true;
    }
}

/* A change takes two flip-flops to reach the registers; until then GATE is not asked, and no conversion ends. */
void run::drive_stops()
{
    bool busy = phase != IDLE && (now.offset & SLOT) == GATE_SLOT;
    bool ends = finish >= 0 && finish - n <= SETTLES + 1;
    if (n >= settled_at && !busy && !ends && !valley_is_near() && random.one_in(stops ? 40 : 3000)) {
        unsigned pin = stops ? (unsigned)__builtin_ctz(stops) : random.below(3);
        stops ^= 1u << pin;
        settled_at = n + SETTLES;
        count.stops++;
        f->ops->stop(f, (gate_latch)latch_of[pin], stops != 0, n * CLOCK_PS);
    }
    top.pin_overcurrent = stops & 1;
    top.pin_driver_fault = (stops >> 1) & 1;
    top.pin_clock_ok = !((stops >> 2) & 1);
}

/* Test pulses, requests, lines that hang; one alone or both. The model sees no pulse of two clocks or less. */
void run::drive_sto()
{
    for (int k = 0; k < 2; k++) {
        if (n != sto_changes[k]) {
            continue;
        }
        sto_low[k] = !sto_low[k];
        f->ops->stop(f, k ? GATE_STO_B : GATE_STO_A, sto_low[k], n * CLOCK_PS);
        uint32_t most = sto_low[k]         ? random.one_in(6) ? 3 * STO_APART : 3 * STO_TEST / 2
                        : random.one_in(3) ? STO_TEST
                                           : 4000;
        sto_changes[k] = n + 3 + random.below(most);
        if (sto_low[k] && !sto_low[1 - k] && random.one_in(2)) {
            sto_changes[1 - k] = n + 3 + random.below(STO_TEST);
        }
        count.tests += sto_low[k];
    }
    top.pin_sto_a_n = !sto_low[0];
    top.pin_sto_b_n = !sto_low[1];
}

void run::drive_lines()
{
    wind.clock(random);
    top.pin_a = wind.a();
    top.pin_b = wind.b();
    top.pin_index = wind.index();
    top.pin_hall = (uint8_t)wind.hall;
    if (random.one_in(top.pin_lost ? 200 : 20000)) {
        top.pin_lost = !top.pin_lost;
    }
}

void run::drive_converters()
{
    unsigned data = 0;
    for (int k = 0; k < 4; k++) {
        line_of[k].code = sampled[k];
        data |= converter_follow(&line_of[k], AD7356_ZEROS, top.pin_cs_n, top.pin_sclk) ? 1u << k : 0u;
    }
    top.pin_sdata = (uint8_t)data;
    thermometer.code = temperature;
    top.pin_temp_sdata = converter_follow(&thermometer, AD7476A_ZEROS, top.pin_temp_cs_n, top.pin_temp_sclk);
}

/* ---- outputs ---- */

bool run::differs(const char *what, uint32_t rtl, uint32_t model_says) const
{
    if (rtl == model_says) {
        return false;
    }
    std::printf("lockstep: clock %lld: %s: the RTL has 0x%x, the model 0x%x\n", (long long)n, what, rtl, model_says);
    return true;
}

/* Of a driver with an input and an enable: which side it turns on; the input of one that is off says nothing. */
unsigned gates_of(const Vfabric_axis &top)
{
    unsigned gates = 0, high = IN_EN ? top.pin_high & top.pin_low : top.pin_high;
    unsigned low = IN_EN ? top.pin_low & ~high : top.pin_low;
    for (int k = 0; k < 3; k++) {
        gates |= ((high >> k) & 1u) << (2 * k) | ((low >> k) & 1u) << (2 * k + 1);
    }
    return gates;
}

/* The chopper hears of a sample a clock after the results. */
bool run::compare()
{
    bool framed = n >= frame_from && n <= frame_to;
    bool warm = temp_from >= 0 && n >= temp_from && n < temp_from + TEMP_FRAME;
    bool on = n == results_at ? chopped : model.gate.chopper.on;
    bool chops = on && model.gate.chopper.enabled && !(model.gate.asking & GATE_CLOCK_LOST);
    count.chops += chops;
    bool bad = differs("gates", gates_of(top), f->gates);
    bad = differs("interrupt", top.irq, f->interrupt) || bad;
    bad = differs("chopper", top.pin_chopper, chops) || bad;
    bad = differs("CS", top.pin_cs_n, !framed) || bad;
    bad = differs("SCLK", top.pin_sclk, !framed || !((n - frame_from) & 1)) || bad;
    bad = differs("CS of the thermometer", top.pin_temp_cs_n, !warm) || bad;
    bad = differs("its SCLK", top.pin_temp_sclk, !warm || !(((n - temp_from) / 4) & 1)) || bad;
    bad = differs("modulators' clock", top.pin_mod_clock, 0) || bad;
    bad = differs("PREADY, PSLVERR", top.pready * 2u + top.pslverr, 2) || bad;
    if (rested && differs("PRDATA at rest", top.prdata, 0)) {
        return true;
    }
    if (phase == ACCESS && !now.writes && differs("a read", top.prdata, expected)) {
        std::printf("lockstep: that was offset 0x%x\n", now.offset);
        return true;
    }
    return bad;
}

/* ---- from clock n to clock n + 1 ---- */

unsigned run::hall_levels() const
{
    return (unsigned)hall[0].level | (unsigned)hall[1].level << 1 | (unsigned)hall[2].level << 2;
}

/* One edge; if the index has risen with it, its pulse begins there. */
void run::turn_model(int step, bool indexes)
{
    constexpr int64_t FAR = 1000000;
    decoded += step;
    int64_t place = indexes ? decoded : decoded + FAR;
    index_pulse pulse = {place, place, 4 * FAR};
    shaft_way way = {decoded, step, 0, 0, (double)(n * CLOCK_PS)};
    count.edges++;
    f->ops->turn(f, &way, &pulse);
}

/* The model's index comes with an edge of A or B, as a disc's does. Filtered lines may part them: then the bench does what the
 * page says. */
void run::index_without_edge()
{
    if ((model.encoder.control & 1) && !model.encoder.cut) {
        model.encoder.index = model.encoder.position;
        model.encoder.status |= 1;
    }
}

/* What the levels of clock n have done to the counter by clock n + 1. */
void run::follow_lines()
{
    bool indexes = z.level && !z_was;
    bool a_moved = a.level != a_was, b_moved = b.level != b_was;
    if (a_moved != b_moved) {
        int step = a.level != b_was ? 1 : -1;
        turn_model(step, indexes);
    } else if (a_moved) {
        f->ops->disturb_cable(f, CABLE_ILLEGAL, 0);
    }
    if (indexes && a_moved == b_moved) {
        index_without_edge();
    }
    f->ops->show_hall(f, hall_levels(), (double)(n * CLOCK_PS));
    a_was = a.level;
    b_was = b.level;
    z_was = z.level;
    uint8_t length = (uint8_t)model.encoder.filter, hall_length = (uint8_t)(model.encoder.filter >> 8);
    a.clock(top.pin_a, length, true);
    b.clock(top.pin_b, length, true);
    z.clock(top.pin_index, length, true);
    for (int k = 0; k < 3; k++) {
        hall[k].clock((top.pin_hall >> k) & 1, hall_length, n % 16 == 0);
    }
    lost[1] = lost[0];
    lost[0] = top.pin_lost;
}

bool is_status(uint32_t offset)
{
    return offset == ADC_STATUS || offset == ENC_STATUS || offset == GATE_STATUS;
}

/* Where a write stands among what else makes the next clock. What comes up in the clock of its clearing stays, so a status is
 * written first; the encoder's settings act on edges from the next clock on, but on a latch at once. */
enum turn_of_write { BEFORE_LINES, BEFORE_EVENTS, AFTER_EVENTS };

turn_of_write turn_of(uint32_t offset)
{
    return is_status(offset) ? BEFORE_LINES : (offset & SLOT) == ENC_SLOT ? BEFORE_EVENTS : AFTER_EVENTS;
}

void run::write(int turn)
{
    if (phase != ACCESS || !now.writes || turn_of(now.offset) != turn) {
        return;
    }
    count.writes++;
    count.written[now.offset / 4] = true;
    f->ops->write(f, now.offset, now.value, (n + (turn == AFTER_EVENTS)) * CLOCK_PS);
    if (!f->ops->converting(f) && finish > n) {
        finish = -1;
        frame_to = frame_to < n + 1 ? frame_to : n + 1;
    }
}

void run::take_events()
{
    sim_ps at = (n + 1) * CLOCK_PS;
    bool triggered = false;
    unsigned gates = f->gates;
    uint32_t latches = model.gate.latches;
    bool waited = pwm_waits(&model.pwm);
    if (n + 1 == temp_ready) {
        f->ops->sense(f, temperature == 1280 ? 800 : 951);
    }
    if (n == finish) {
        chopped = model.gate.chopper.on;
        results_at = n + 1;
        count.conversions++;
        count.overruns += (model.adc.status & EOC) != 0;
        if (temp_from < 0 || n + 1 >= temp_from + TEMP_FRAME) {
            temp_from = n + 2;
            temp_ready = temp_ready < 0 ? temp_from + TEMP_READY : temp_ready; /* the code is the same in a whole run */
        }
    }
    while (f->ops->next_event(f) <= at) {
        triggered = (f->ops->take_event(f) & FABRIC_TRIGGERED) || triggered;
    }
    f->ops->catch_up(f, at);
    count.followed += waited && model.pwm.running;
    uint32_t latched = model.gate.latches & ~latches;
    count.missed += (latched & (GATE_SLOW_LOST | GATE_THREAD_LOST)) != 0;
    count.asked += (latched & (GATE_STO_A | GATE_STO_B)) != 0;
    count.apart += (latched & GATE_STO_APART) != 0;
    count.unanswered += (latched & GATE_LOOP_LOST) && n != finish;
    count.gate_changes += gates != f->gates;
    write(AFTER_EVENTS);
    triggered_at = triggered ? n + 1 : triggered_at;
    if (triggered && f->ops->listens(f)) {
        for (uint32_t &code : sampled) {
            code = random.one_in(8) ? random.below(2) * 4095 : random.below(4096);
        }
        f->ops->convert(f, sampled, at);
        frame_from = n + 2;
        frame_to = frame_from + FRAME - 1;
        finish = n + CONVERSION;
    }
}

bool run::play()
{
    int64_t clocks = how.dozes ? DOZING_CLOCKS : RUN_CLOCKS;
    for (n = 0; n < clocks; n++, count.clocks++) {
        drive_bus();
        drive_stops();
        drive_sto();
        drive_lines();
        drive_converters();
        top.sync_in = AXIS != 0 && led.syncs();
        top.clk = 0;
        top.eval();
        if (compare()) {
            return false;
        }
        f->ops->disturb_cable(f, CABLE_CUT, lost[1]);
        write(BEFORE_LINES);
        follow_lines();
        write(BEFORE_EVENTS);
        take_events();
        if (AXIS != 0) {
            led.clock(random, n);
        }
        top.clk = 1;
        top.eval();
    }
    return true;
}

/* A reset in whatever state the run before left: all gates are off in the same clock. */
bool reset(Vfabric_axis &top)
{
    top.rst_n = 0;
    top.clk = 0;
    top.eval();
    bool off = gates_of(top) == 0 && !top.pin_chopper;
    if (!off) {
        std::printf("lockstep: a reset leaves gates on\n");
    }
    top.psel = top.pin_a = top.pin_b = top.pin_index = top.pin_lost = top.pin_hall = 0;
    top.pin_overcurrent = top.pin_driver_fault = 0;
    top.pin_sto_a_n = top.pin_sto_b_n = top.pin_clock_ok = 1;
    for (int k = 0; k < 2; k++) {
        top.clk = 0;
        top.eval();
        top.clk = 1;
        top.eval();
    }
    top.rst_n = 1;
    return off;
}

void report_offsets(const bool words[0x100])
{
    std::printf("lockstep: offsets");
    for (int n = 0; n < 0x100; n++) {
        if (words[n]) {
            std::printf(" %d", 4 * n);
        }
    }
    std::printf("\n");
}

int report(const tally &t, uint64_t seed)
{
    std::printf("lockstep: no difference in %lld clocks (seed %llu): %lld reads, %lld writes, %lld gate edges, "
                "%lld conversions, %lld overruns, %lld stop edges, %lld encoder edges, %lld clocks chopping, "
                "%lld proofs late, %lld periods without compares, %lld starts with the leader, %lld falls of STO, "
                "%lld that stop, %lld that stay apart\n",
                (long long)t.clocks, (unsigned long long)seed, (long long)t.reads, (long long)t.writes,
                (long long)t.gate_changes, (long long)t.conversions, (long long)t.overruns, (long long)t.stops,
                (long long)t.edges, (long long)t.chops, (long long)t.missed, (long long)t.unanswered,
                (long long)t.followed, (long long)t.tests, (long long)t.asked, (long long)t.apart);
    report_offsets(t.read);
    report_offsets(t.written);
    return 0;
}
} // namespace

int main(int argc, char **argv)
{
    if (argc != 4) {
        std::fprintf(stderr, "usage: lockstep SEED CLOCKS COVERAGE-FILE\n");
        return 2;
    }
    uint64_t seed = std::strtoull(argv[1], nullptr, 0);
    int64_t clocks = std::strtoll(argv[2], nullptr, 0);
    auto context = std::make_unique<VerilatedContext>();
    auto top = std::make_unique<Vfabric_axis>(context.get());
    auto count = std::make_unique<tally>();
    for (uint64_t k = 0; count->clocks < clocks; k++) {
        auto one = std::make_unique<run>(*top, seed * 1000003 + k, *count);
        if (!reset(*top) || !one->play()) {
            std::printf("lockstep: run %llu of seed %llu\n", (unsigned long long)k, (unsigned long long)seed);
            return 1;
        }
    }
    context->coveragep()->write(argv[3]);
    return report(*count, seed);
}

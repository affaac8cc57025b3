// SPDX-License-Identifier: GPL-2.0-or-later
#include "rtl_axis.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "Vfabric_axis.h"
#include "Vfabric_axis___024root.h"
#include "verilated.h"

enum { WORTH_IT = 12, PATIENCE = 6 }; /* clocks: a try costs about as many */

struct rtl_axis {
    VerilatedContext context;
    Vfabric_axis top{&context, ""};
    uint64_t seen = 0; /* outputs, as a key */
    int rest = 0;      /* clocks before the next try to take many at once */
    rtl_bits *bits = nullptr; /* of the modulators */
    void *bits_of = nullptr;
    bool checks = std::getenv("MSSFOC_EVERY_CLOCK") != nullptr;
};

#if VERILATOR_VERSION_INTEGER == 5006000
#define INNER_NAMES /* of this version are known here */
void Vfabric_axis___024root___eval_nba(Vfabric_axis___024root *root);
void Vfabric_axis___024root___eval_settle(Vfabric_axis___024root *root);
#endif

namespace
{
using root_type = Vfabric_axis___024root;

#define PWM(root, name)        (root)->fabric_axis__DOT__carrier_and_legs__DOT__##name
#define UPDATES(root, k, name) PWM(root, leg__BRA__##k##__KET____DOT__updates__DOT__##name)
#define BRIDGE(root, k, name)  PWM(root, leg__BRA__##k##__KET____DOT__half_bridge__DOT__##name)
#define ADC(root, name)        (root)->fabric_axis__DOT__sampler__DOT__##name
#define FILTERS(root, name)    ADC(root, isolated__DOT__##name)
#define LOW_FOR(root, k)       (root)->fabric_axis__DOT__sampler__DOT__shunts__DOT__phase__BRA__##k##__KET____DOT__on_for

/* A clock with still inputs, clk being 0 before and behind it. eval() would ask twice what the inputs have done and when the
 * clock rises. */
void one_clock(Vfabric_axis &top)
{
#ifdef INNER_NAMES
    top.rootp->__VnbaTriggered.at(0) = 1;
    Vfabric_axis___024root___eval_nba(top.rootp);
    top.rootp->__VnbaTriggered.at(0) = 0;
#else
    top.clk = 1;
    top.eval();
    top.clk = 0;
    top.eval();
#endif
}

void drive(Vfabric_axis &top, const rtl_inputs &in)
{
    top.rst_n = in.rst_n;
    top.psel = in.psel;
    top.penable = in.penable;
    top.pwrite = in.pwrite;
    top.paddr = in.paddr;
    top.pwdata = in.pwdata;
    top.sync_in = 0;
    top.pin_overcurrent = in.overcurrent;
    top.pin_driver_fault = in.driver_fault;
    top.pin_sto_a_n = in.sto_a_n;
    top.pin_sto_b_n = in.sto_b_n;
    top.pin_clock_ok = in.clock_ok;
    top.pin_sdata = in.sdata;
    top.pin_hall = in.hall;
    top.pin_temp_sdata = in.temp_sdata;
    top.pin_a = in.a;
    top.pin_b = in.b;
    top.pin_index = in.index;
    top.pin_lost = in.lost;
}

/* All of them in two words, to see at once whether one has changed. */
uint64_t key_of(const Vfabric_axis &top)
{
    const Vfabric_axis___024root *root = top.rootp;
    return (uint64_t)top.prdata << 32 | (uint32_t)top.pin_high << 16 | (uint32_t)top.pin_low << 8 |
           (uint32_t)root->fabric_axis__DOT__trip << 12 | (uint32_t)root->fabric_axis__DOT__sample << 13 |
           (uint32_t)top.pin_chopper << 7 | (uint32_t)top.irq << 6 | (uint32_t)top.pin_cs_n << 5 |
           (uint32_t)top.pin_sclk << 4 | (uint32_t)top.pin_temp_cs_n << 3 | (uint32_t)top.pin_temp_sclk << 2 |
           (uint32_t)root->fabric_axis__DOT__trigger << 1 | root->fabric_axis__DOT__live;
}

rtl_outputs outputs(const Vfabric_axis &top)
{
    const Vfabric_axis___024root *root = top.rootp;
    rtl_outputs out = {};
    out.prdata = top.prdata;
    out.high = top.pin_high;
    out.low = top.pin_low;
    out.chopper = top.pin_chopper;
    out.irq = top.irq;
    out.cs_n = top.pin_cs_n;
    out.sclk = top.pin_sclk;
    out.temp_cs_n = top.pin_temp_cs_n;
    out.temp_sclk = top.pin_temp_sclk;
    out.trigger = root->fabric_axis__DOT__trigger;
    out.live = root->fabric_axis__DOT__live;
    out.trip = root->fabric_axis__DOT__trip;
    out.converted = root->fabric_axis__DOT__sample;
    return out;
}

rtl_axis *create()
{
    return new rtl_axis;
}

void settle(rtl_axis *axis, const rtl_inputs *in, rtl_outputs *out)
{
    drive(axis->top, *in);
    axis->top.clk = 0;
    axis->top.eval();
    axis->seen = key_of(axis->top);
    *out = outputs(axis->top);
}

#ifdef INNER_NAMES
/* ---- many clocks at once ---- */

/* The registers that go on counting while nothing else happens. */
struct counters {
    int64_t count, now, age, left[3], low_for[3];
};

counters counters_of(const root_type *root)
{
    return {PWM(root, carrier__DOT__count),
            root->fabric_axis__DOT__shaft__DOT__now,
            root->fabric_axis__DOT__bridge__DOT__brake_chopper__DOT__age,
            {BRIDGE(root, 0, left), BRIDGE(root, 1, left), BRIDGE(root, 2, left)},
            {LOW_FOR(root, 0), LOW_FOR(root, 1), LOW_FOR(root, 2)}};
}

void set_counters(root_type *root, const counters &c)
{
    PWM(root, count) = PWM(root, carrier__DOT__count) = (uint16_t)c.count;
    root->fabric_axis__DOT__shaft__DOT__now = (uint32_t)c.now;
    root->fabric_axis__DOT__bridge__DOT__brake_chopper__DOT__age = (uint16_t)c.age;
    BRIDGE(root, 0, left) = (uint8_t)c.left[0];
    BRIDGE(root, 1, left) = (uint8_t)c.left[1];
    BRIDGE(root, 2, left) = (uint8_t)c.left[2];
    LOW_FOR(root, 0) = (uint16_t)c.low_for[0];
    LOW_FOR(root, 1) = (uint16_t)c.low_for[1];
    LOW_FOR(root, 2) = (uint16_t)c.low_for[2];
}

int64_t extrapolated(int64_t before, int64_t after, int64_t clocks)
{
    return after + (after - before) * clocks;
}

/* Where counters that went from a to b in one clock are so many clocks later. */
counters later(const counters &a, const counters &b, int64_t clocks)
{
    counters c = {extrapolated(a.count, b.count, clocks),
                  extrapolated(a.now, b.now, clocks),
                  extrapolated(a.age, b.age, clocks),
                  {},
                  {}};
    for (int k = 0; k < 3; k++) {
        c.left[k] = extrapolated(a.left[k], b.left[k], clocks);
        c.low_for[k] = extrapolated(a.low_for[k], b.low_for[k], clocks);
    }
    return c;
}

bool one_of(int64_t step, int64_t other)
{
    return step == 0 || step == other;
}

/* From a to b each has counted its way, or rested. One that was set anew has not. */
bool counted(const counters &a, const counters &b, bool rising)
{
    bool all = one_of(b.count - a.count, rising ? 1 : -1) && b.now - a.now == 1 && one_of(b.age - a.age, 1);
    for (int k = 0; k < 3; k++) {
        all = all && one_of(b.left[k] - a.left[k], -1) && one_of(b.low_for[k] - a.low_for[k], 1);
    }
    return all;
}

int64_t lesser(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

/* For how many clocks no counter reaches what something compares it with. */
int64_t until_compared(const root_type *root)
{
    bool rising = PWM(root, carrier__DOT__rising);
    int64_t count = PWM(root, carrier__DOT__count), last = (int64_t)PWM(root, period) - 1;
    const int64_t against[] = {UPDATES(root, 0, compare),     UPDATES(root, 1, compare),     UPDATES(root, 2, compare),
                               PWM(root, trigger_1) & 0xFFFF, PWM(root, trigger_2) & 0xFFFF, rising ? last : 1};
    counters c = counters_of(root);
    int64_t clocks = INT32_MAX;
    for (int64_t value : against) {
        int64_t way = rising ? value - count : count - value;
        clocks = way >= 0 && PWM(root, carrier__DOT__running) ? lesser(clocks, way) : clocks;
    }
    for (int k = 0; k < 3; k++) {
        clocks = c.left[k] > 1 ? lesser(clocks, c.left[k] - 1) : clocks;
        clocks = c.low_for[k] < 0xFFF ? lesser(clocks, 0xFFF - c.low_for[k]) : clocks;
    }
    return c.age < 0xFFFF ? lesser(clocks, 0xFFFF - c.age) : clocks;
}

struct state {
    alignas(root_type) unsigned char bytes[sizeof(root_type)];

    void keep(const root_type *root)
    {
        std::memcpy(bytes, static_cast<const void *>(root), sizeof bytes);
    }
    void put_back(root_type *root) const
    {
        std::memcpy(static_cast<void *>(root), bytes, sizeof bytes);
    }
    bool is(const root_type *root) const
    {
        return std::memcmp(bytes, static_cast<const void *>(root), sizeof bytes) == 0;
    }
};

void follow(root_type *root, const counters &c)
{
    set_counters(root, c);
    Vfabric_axis___024root___eval_settle(root);
}

/* Every clock of a glide besides, for tests: the state is the same to the last bit. */
void check(rtl_axis *axis, const state &start, int64_t clocks)
{
    state glided;
    glided.keep(axis->top.rootp);
    start.put_back(axis->top.rootp);
    for (int64_t n = 0; n < clocks; n++) {
        one_clock(axis->top);
    }
    Vfabric_axis___024root___eval_settle(axis->top.rootp);
    if (!glided.is(axis->top.rootp)) {
        std::fprintf(stderr, "mssfoc twin: FABRIC=rtl: %lld clocks at once are not what they are one by one\n",
                     (long long)clocks);
        std::exit(1);
    }
}

/* One clock. If all it did is to count, the same again up to the next comparison, at once: counters are set, and the logic
 * behind them settles. Returns the clocks it took. */
int64_t glide(rtl_axis *axis, int64_t most)
{
    root_type *root = axis->top.rootp;
    int64_t clocks = lesser(most, until_compared(root));
    if (clocks < WORTH_IT || ADC(root, modulators) || root->fabric_axis__DOT__shaft__DOT__hall_state != axis->top.pin_hall) {
        one_clock(axis->top);
        return 1;
    }
    state before, after;
    Vfabric_axis___024root___eval_settle(root);
    before.keep(root);
    counters from = counters_of(root);
    one_clock(axis->top);
    Vfabric_axis___024root___eval_settle(root);
    after.keep(root);
    counters to = counters_of(root);
    bool as_ever = counted(from, to, PWM(root, carrier__DOT__rising));
    before.put_back(root);
    follow(root, to);
    if (!as_ever || !after.is(root)) {
        after.put_back(root);
        axis->rest = PATIENCE;
        return 1;
    }
    follow(root, later(from, to, clocks - 1));
    if (axis->checks) {
        check(axis, before, clocks);
    }
    return clocks;
}
#else
int64_t glide(rtl_axis *axis, int64_t)
{
    one_clock(axis->top);
    return 1;
}
#endif

uint64_t run(rtl_axis *axis, uint64_t clocks, rtl_outputs *out)
{
    Vfabric_axis &top = axis->top;
    uint64_t n = 0, key = axis->seen;
    bool mod_clock = top.pin_mod_clock;
    while (n < clocks && key == axis->seen) {
        if (axis->rest > 0) {
            axis->rest--;
            one_clock(top);
            n++;
        } else {
            n += (uint64_t)glide(axis, (int64_t)(clocks - n));
        }
        if (top.pin_mod_clock && !mod_clock && axis->bits) {
            top.pin_mod_data = (uint8_t)axis->bits(axis->bits_of, n);
        }
        mod_clock = top.pin_mod_clock;
        key = key_of(top);
    }
    axis->seen = key;
    *out = outputs(top);
    return n;
}

#define LOOK_AT_LEG(k) \
    pwm->compare[k] = UPDATES(root, k, compare); \
    pwm->waiting[k] = UPDATES(root, k, waiting); \
    pwm->side[k] = BRIDGE(root, k, side); \
    pwm->on[k] = BRIDGE(root, k, on); \
    pwm->left[k] = BRIDGE(root, k, left)

/* ---- when the modulators' filters decide ---- */

enum { COMB = 4, COMPARISON = 6, ARITHMETIC = 12 }; /* clocks: from a take to `ready`, from there to `trip`, to the results */

/* Clocks up to and with the one in which the next bit is taken: the one behind COUNT 1. */
int64_t until_bit(const root_type *root)
{
    int64_t period = FILTERS(root, last) + 1, count = FILTERS(root, count);
    return (period + 1 - count) % period + 1;
}

int64_t until_trip(const root_type *root)
{
    int64_t step = FILTERS(root, step), comb = FILTERS(root, phase__BRA__0__KET____DOT__trip_comb__DOT__step);
    if (!ADC(root, modulators)) {
        return 0;
    }
    if (step != 0) {
        return COMPARISON - step;
    }
    if (FILTERS(root, phase__BRA__0__KET____DOT__trip_comb__DOT__ready)) {
        return COMPARISON;
    }
    if (comb != 0) {
        return COMB - comb + COMPARISON;
    }
    int64_t period = FILTERS(root, last) + 1;
    return until_bit(root) + FILTERS(root, trip_bits) * period + COMB - 1 + COMPARISON;
}

/* From the first take on. */
int64_t until_last_take(const root_type *root, int64_t takes)
{
    return (takes - 1) * (32 << ADC(root, osr)) * (FILTERS(root, last) + 1);
}

int64_t until_results(const root_type *root)
{
    int64_t step = ADC(root, math__DOT__step), comb = FILTERS(root, phase__BRA__0__KET____DOT__comb__DOT__step);
    int64_t takes = FILTERS(root, takes), bit = until_bit(root), period = FILTERS(root, last) + 1;
    if (!ADC(root, modulators) || !ADC(root, enable)) {
        return 0;
    }
    if (!ADC(root, busy)) { /* the bit that comes with the start is not taken */
        int64_t first = bit > 1 ? bit : bit + period;
        return root->fabric_axis__DOT__trigger ? first + until_last_take(root, 4) + COMB - 1 + ARITHMETIC : 0;
    }
    if (step != 0) {
        return ARITHMETIC - step;
    }
    if (takes != 0) {
        return bit + FILTERS(root, bits) * period + until_last_take(root, takes) + COMB - 1 + ARITHMETIC;
    }
    return ARITHMETIC + (comb != 0 ? COMB - comb : 0);
}

void look(const rtl_axis *axis, rtl_pwm *pwm, rtl_adc *adc)
{
    const root_type *root = axis->top.rootp;
    pwm->control = (uint32_t)PWM(root, run) | (uint32_t)PWM(root, brake) << 1;
    pwm->period = PWM(root, period);
    pwm->phase = PWM(root, phase);
    pwm->dead = PWM(root, dead);
    pwm->min_pulse = PWM(root, min_pulse);
    pwm->mode = PWM(root, mode);
    pwm->trigger[0] = PWM(root, trigger_1);
    pwm->trigger[1] = PWM(root, trigger_2);
    pwm->newest[0] = PWM(root, compare_a);
    pwm->newest[1] = PWM(root, compare_b);
    pwm->newest[2] = PWM(root, compare_c);
    pwm->count = PWM(root, carrier__DOT__count);
    pwm->running = PWM(root, carrier__DOT__running);
    pwm->rising = PWM(root, carrier__DOT__rising);
    pwm->fresh = UPDATES(root, 0, fresh);
    *adc = {until_trip(root), until_results(root)};
    LOOK_AT_LEG(0);
    LOOK_AT_LEG(1);
    LOOK_AT_LEG(2);
}

void modulate(rtl_axis *axis, rtl_bits *bits, void *context)
{
    axis->bits = bits;
    axis->bits_of = context;
}
} // namespace

const rtl_axis_calls *rtl_axis_open(void)
{
    static const rtl_axis_calls calls = {RTL_AXIS_VERSION, create, settle, run, look, modulate};
    return &calls;
}

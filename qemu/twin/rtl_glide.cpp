// SPDX-License-Identifier: GPL-2.0-or-later
// Many clocks at once: where a clock does nothing but count, the counters are set to where they will be, and where modulators
// run, their filters are clocked alone.
#include "rtl_names.h"

#ifdef INNER_NAMES
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

enum { WORTH_IT = 12, PATIENCE = 6 }; /* clocks: a try costs about as many */

namespace
{
/* The registers that go on counting while nothing else happens. */
struct counters {
    int64_t count, now, age, watch, sto[2], apart, left[3], low_for[3];
};

counters counters_of(const root_type *root)
{
    return {PWM(root, carrier__DOT__count),
            WIRE(root, shaft__DOT__now),
            WIRE(root, bridge__DOT__brake_chopper__DOT__age),
            WATCH(root, left),
            {STO(root, filter_a__DOT__count), STO(root, filter_b__DOT__count)},
            STO(root, apart_for),
            {BRIDGE(root, 0, left), BRIDGE(root, 1, left), BRIDGE(root, 2, left)},
            {LOW_FOR(root, 0), LOW_FOR(root, 1), LOW_FOR(root, 2)}};
}

void set_counters(root_type *root, const counters &c)
{
    PWM(root, count) = PWM(root, carrier__DOT__count) = (uint16_t)c.count;
    WIRE(root, shaft__DOT__now) = (uint32_t)c.now;
    WIRE(root, bridge__DOT__brake_chopper__DOT__age) = (uint16_t)c.age;
    WATCH(root, left) = (uint32_t)c.watch;
    STO(root, filter_a__DOT__count) = (uint32_t)c.sto[0];
    STO(root, filter_b__DOT__count) = (uint32_t)c.sto[1];
    STO(root, apart_for) = (uint32_t)c.apart;
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
                  extrapolated(a.watch, b.watch, clocks),
                  {extrapolated(a.sto[0], b.sto[0], clocks), extrapolated(a.sto[1], b.sto[1], clocks)},
                  extrapolated(a.apart, b.apart, clocks),
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
    bool all = one_of(b.count - a.count, rising ? 1 : -1) && b.now - a.now == 1 && one_of(b.age - a.age, 1) &&
               one_of(b.watch - a.watch, -1) && one_of(b.apart - a.apart, 1) && std::abs(b.sto[0] - a.sto[0]) <= 1 &&
               std::abs(b.sto[1] - a.sto[1]) <= 1;
    for (int k = 0; k < 3; k++) {
        all = all && one_of(b.left[k] - a.left[k], -1) && one_of(b.low_for[k] - a.low_for[k], 1);
    }
    return all;
}

/* For how many clocks no counter reaches what something compares it with; the carrier knows a count ahead
 * whether it turns. */
int64_t until_compared(const root_type *root)
{
    bool rising = PWM(root, carrier__DOT__rising);
    int64_t count = PWM(root, carrier__DOT__count), last = (int64_t)PWM(root, period) - 1;
    const int64_t against[] = {UPDATES(root, 0, compare),
                               UPDATES(root, 1, compare),
                               UPDATES(root, 2, compare),
                               PWM(root, trigger_1) & 0xFFFF,
                               PWM(root, trigger_2) & 0xFFFF,
                               rising ? last - 1 : last,
                               1};
    counters c = counters_of(root);
    int64_t clocks = INT32_MAX;
    for (int64_t value : against) {
        int64_t way = rising ? value - count : count - value;
        clocks = way >= 0 && PWM(root, carrier__DOT__running) ? rtl_lesser(clocks, way) : clocks;
    }
    for (int k = 0; k < 3; k++) {
        clocks = c.left[k] > 1 ? rtl_lesser(clocks, c.left[k] - 1) : clocks;
        clocks = c.low_for[k] < 0xFFF ? rtl_lesser(clocks, 0xFFF - c.low_for[k]) : clocks;
    }
    clocks = WATCH(root, watches) ? rtl_lesser(clocks, c.watch) : clocks;
    for (int64_t low_for : c.sto) { /* to either end */
        int64_t room = (int64_t)STO(root, filter_a__DOT__longest) - low_for;
        clocks = low_for > 0 ? rtl_lesser(clocks, low_for) : clocks;
        clocks = room > 0 ? rtl_lesser(clocks, room) : clocks;
    }
    if (c.apart < (int64_t)STO(root, patience)) {
        clocks = rtl_lesser(clocks, (int64_t)STO(root, patience) - c.apart);
    }
    clocks = c.age < 0xFFFF ? rtl_lesser(clocks, 0xFFFF - c.age) : clocks;
    return ADC(root, modulators) ? rtl_lesser(clocks, rtl_filters_rest(root)) : clocks;
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

/* The bits that came in a stretch, for check(). */
using bits_seen = std::vector<uint8_t>;

/* Filters and modulators over so many clocks. */
void play_filters(rtl_axis *axis, uint64_t from, int64_t clocks, bits_seen *bits)
{
    root_type *root = axis->top.rootp;
    for (int64_t n = 1; n <= clocks; n++) {
        bool was_high = FILTERS(root, pin_clock);
        rtl_filters_clock(root);
        if (FILTERS(root, pin_clock) && !was_high) {
            rtl_take_bits(axis, from + (uint64_t)n);
            bits->push_back(root->pin_mod_data);
        }
    }
}

/* Every clock of a glide besides, for tests: the state is the same to the last bit. */
void check(rtl_axis *axis, const state &start, int64_t clocks, const bits_seen &bits)
{
    state glided;
    glided.keep(axis->top.rootp);
    start.put_back(axis->top.rootp);
    size_t next = 0;
    for (int64_t n = 0; n < clocks; n++) {
        bool was_high = axis->top.pin_mod_clock;
        rtl_one_clock(axis->top);
        if (axis->top.pin_mod_clock && !was_high && next < bits.size()) {
            axis->top.pin_mod_data = bits[next++];
        }
    }
    Vfabric_axis___024root___eval_settle(axis->top.rootp);
    if (!glided.is(axis->top.rootp)) {
        std::fprintf(stderr, "mssfoc twin: FABRIC=rtl: %lld clocks at once are not what they are one by one\n",
                     (long long)clocks);
        std::exit(1);
    }
}
} // namespace

/* One clock. If all it did is to count, the same again up to the next comparison, at once: counters are set, and the logic
 * behind them settles. */
int64_t rtl_glide(rtl_axis *axis, uint64_t from, int64_t most)
{
    root_type *root = axis->top.rootp;
    int64_t clocks = rtl_lesser(most, until_compared(root));
    bool modulated = ADC(root, modulators);
    if (clocks < WORTH_IT || WIRE(root, shaft__DOT__hall_state) != axis->top.pin_hall) {
        return 0;
    }
    state before, after;
    Vfabric_axis___024root___eval_settle(root);
    before.keep(root);
    counters a = counters_of(root);
    rtl_one_clock(axis->top);
    Vfabric_axis___024root___eval_settle(root);
    after.keep(root);
    counters b = counters_of(root);
    bool as_ever = counted(a, b, PWM(root, carrier__DOT__rising));
    before.put_back(root);
    if (modulated) {
        rtl_filters_clock(root);
    }
    follow(root, b);
    bool same = after.is(root);
    before.put_back(root);
    if (!as_ever || !same) {
        axis->rest = PATIENCE;
        return 0;
    }
    bits_seen bits;
    if (modulated) {
        play_filters(axis, from, clocks, &bits);
    }
    follow(root, later(a, b, clocks - 1));
    if (axis->checks) {
        check(axis, before, clocks, bits);
    }
    return clocks;
}
#else
int64_t rtl_glide(rtl_axis *, uint64_t, int64_t)
{
    return 0;
}
#endif

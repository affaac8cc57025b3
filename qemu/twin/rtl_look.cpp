// SPDX-License-Identifier: GPL-2.0-or-later
// What the RTL's registers say of the time in which nothing is decided.
#include "rtl_names.h"

namespace
{
enum {
    COMB = 4,
    COMPARISON = 6,
    ARITHMETIC = 12
}; /* clocks: from a take to `ready`, from there to `trip`, to the results */

/* Clocks up to and with the one in which the next bit is taken: the one behind COUNT 1. */
int64_t until_bit(const root_type *root)
{
    int64_t period = FILTERS(root, last) + 1, count = FILTERS(root, count);
    return (period + 1 - count) % period + 1;
}

int64_t until_trip(const root_type *root)
{
    int64_t step = FILTERS(root, step), comb = FILTER(root, 0, trip_comb__DOT__step);
    if (!ADC(root, modulators)) {
        return 0;
    }
    if (step != 0) {
        return COMPARISON - step;
    }
    if (FILTER(root, 0, trip_comb__DOT__ready)) {
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
    int64_t step = ADC(root, math__DOT__step), comb = FILTER(root, 0, comb__DOT__step);
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

/* The counter passes 0, and the latch shows it. */
int64_t until_watch(const root_type *root)
{
    int64_t left = WATCH(root, left);
    return !WATCH(root, watches) ? 0 : left >> 20 ? 1 : left + 2;
}

/* Of one input that is low, in front of its two flip-flops or behind them: the counter up to the longest test. 0: it is not, or
 * asks already. */
int64_t until_asked(int low, bool pin_low, bool asks, int64_t left)
{
    return asks || (low == 0 && !pin_low) ? 0 : left + 1;
}

int64_t until_sto(const root_type *root)
{
#define UNTIL_ASKED(x) \
    until_asked(STO(root, filter_##x##__DOT__low), !root->pin_sto_##x##_n, STO(root, filter_##x##__DOT__asks), \
                (int64_t)STO(root, filter_##x##__DOT__longest) - STO(root, filter_##x##__DOT__count))
    int64_t a = UNTIL_ASKED(a), b = UNTIL_ASKED(b);
    return a == 0 || b == 0 ? a + b : rtl_lesser(a, b);
}
} // namespace

int64_t rtl_filters_rest(const root_type *root)
{
    bool works = FILTERS(root, step) != 0 || FILTER(root, 0, trip_comb__DOT__step) != 0 ||
                 FILTER(root, 0, trip_comb__DOT__ready) || FILTER(root, 0, comb__DOT__step) != 0 ||
                 FILTER(root, 0, comb__DOT__ready);
    if (works) {
        return 0;
    }
    int64_t period = FILTERS(root, last) + 1, bit = until_bit(root), trip = FILTERS(root, trip_bits) * period;
    int64_t result = FILTERS(root, takes) != 0 ? FILTERS(root, bits) * period : trip;
    return bit + rtl_lesser(trip, result) - 1;
}

void rtl_look(const rtl_axis *axis, rtl_pwm *pwm, rtl_beside *beside)
{
    const root_type *root = axis->top.rootp;
#define LOOK(name)            pwm->name = PWM(root, name)
#define LOOK_AT_CARRIER(name) pwm->name = PWM(root, carrier__DOT__##name)
#define LOOK_AT_LEG(k, letter) \
    pwm->newest[k] = PWM(root, compare_##letter); \
    pwm->compare[k] = UPDATES(root, k, compare); \
    pwm->waiting[k] = UPDATES(root, k, waiting); \
    pwm->side[k] = BRIDGE(root, k, side); \
    pwm->on[k] = BRIDGE(root, k, on); \
    pwm->left[k] = BRIDGE(root, k, left)
    LOOK(period);
    LOOK(phase);
    LOOK(dead);
    LOOK(min_pulse);
    LOOK(mode);
    LOOK_AT_CARRIER(count);
    LOOK_AT_CARRIER(running);
    LOOK_AT_CARRIER(rising);
    LOOK_AT_LEG(0, a);
    LOOK_AT_LEG(1, b);
    LOOK_AT_LEG(2, c);
    pwm->control = (uint32_t)PWM(root, run) | (uint32_t)PWM(root, brake) << 1;
    pwm->trigger[0] = PWM(root, trigger_1);
    pwm->trigger[1] = PWM(root, trigger_2);
    pwm->fresh = UPDATES(root, 0, fresh);
    *beside = {until_trip(root), until_results(root), until_watch(root), until_sto(root)};
}

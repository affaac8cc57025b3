/* SPDX-License-Identifier: MIT */
/*
 * Units and gains of the position loop and the profile. A unit is 2^-shift counts: the smallest with which speed_max is at most
 * UNITS_MOST units a millisecond, but not below 2^-SHIFT_MOST. The sum of PARAM_JERK_MOST_MS such speeds stays below 2^30.
 */
#include "firmware/settings/config.h"
#include "firmware/settings/scale.h"
#include "firmware/settings/tuning_parts.h"

#define UNITS_MOST (1LL << 22)
#define SHIFT_MOST 24
#define MINUTE_MS  60000LL
#define BW_SHARE   5 /* of the speed loop's, if none is set */
#define MILLI      1000

_Static_assert(CONFIG_SLOW_HZ == 1000, "the profile steps in milliseconds");
_Static_assert(UNITS_MOST *PARAM_JERK_MOST_MS < 1LL << 30, "the profile's sums have 31 bits and a sign");

static int32_t shift_of(const struct params *p)
{
    int32_t shift = 0;
    while (shift < SHIFT_MOST &&
           ((int64_t)p->speed_max_rpm * p->encoder_counts << (shift + 1)) <= UNITS_MOST * MINUTE_MS) {
        shift++;
    }
    return shift;
}

static void tune_profile(const struct params *p, struct tuning_profile *t)
{
    const int64_t counts_a_minute = (int64_t)p->speed_max_rpm * p->profile_speed_pm * p->encoder_counts;
    const int32_t rpm_s = p->profile_rpm_s != 0 ? p->profile_rpm_s : p->ramp_rpm_s;
    const int64_t a = scale((int64_t)rpm_s * p->encoder_counts, 1LL << t->shift, MINUTE_MS * CONFIG_SLOW_HZ);
    t->v_max = scale_clamp(scale(counts_a_minute, 1LL << t->shift, MINUTE_MS * MILLI), 1, INT32_MAX);
    t->a_max = scale_clamp(a, 1, t->v_max);
    t->window = p->profile_jerk_ms;
    t->window_q30 = (1 << 30) / p->profile_jerk_ms;
}

void tuning_position(const struct params *p, struct tuning *t)
{
    t->profile.shift = shift_of(p);
    tune_profile(p, &t->profile);
    const int64_t turn_units = (int64_t)p->encoder_counts << t->profile.shift;
    const int64_t bw_mhz =
        p->position_bw_hz != 0 ? (int64_t)p->position_bw_hz * MILLI : (int64_t)p->speed_bw_hz * MILLI / BW_SHARE;
    t->rpm_per_unit_q20 = (int32_t)scale(MINUTE_MS * 65536, 1 << 20, turn_units);
    t->position_gain_q21 = (int32_t)scale(2LL * t->rpm_per_unit_q20, bw_mhz * (TWO_PI_E9 / MILLI), 1000000000000LL);
    t->following_units = turn_units * p->following_mturn / MILLI;
    t->cyclic_ms = p->cyclic_ms;
    t->home_rpm_q16 = (p->direction != 0 ? -p->home_rpm : p->home_rpm) * 65536;
    t->learn_rpm_q16 = p->learn_rpm * 65536;
    t->turn_scale_q32 = (uint32_t)scale(1, 1LL << 32, p->encoder_counts);
    t->home_i_q15 = t->i_max_q15 * p->home_pct / 100;
}

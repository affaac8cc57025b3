/* SPDX-License-Identifier: MIT */
/*
 * Gains of the speed loop and units of the speed estimate. The plant is Kt/(sJ) with Kt = 1.5 p psi for currents in peak
 * amperes and psi as in mtpa.h, so Kp = w J / Kt; the integral acts below a quarter of the crossover.
 */
#include "firmware/settings/config.h"
#include "firmware/settings/features.h"
#include "firmware/settings/mtpa.h"
#include "firmware/settings/scale.h"
#include "firmware/settings/tuning_parts.h"

/*
 * Kp in Q15 of i_range with 16 more bits, per rpm/16, is KP J f / (p psi i_range) with J in g mm^2 (1e-9 kg m^2), psi in uWb
 * and i_range in mA: KP = 2 pi (2 pi / 60) / 16 * 2^31 / 1.5. Ki is that times 2 pi f / 4, over the slow periods of a second.
 * The same current for an acceleration of 1 rpm/65536 a slow period, in Q8: ACCEL = 2 pi / 60 * 2^31 / 2^16 * 2^8 / 1.5 times
 * the slow periods of a second.
 */
#define KP_E3    58874483510LL
#define KI       92479822LL
#define ACCEL_E6 585635317037LL

#define INERTIA_MOST 2100000000LL /* of the parameter */

/* While edges are far apart, one count of lag weighs this part of i_max. */
#define COUNT_WEIGHS 100

#define FRICTION_MOST_PART 4             /* of i_max */
#define FRICTION           21845333333LL /* 2^15 10^6 / 1.5: from uN m over nWb mA */

/* A turn in the estimate's unit of travel, rpm Q15 times milliseconds; 256 and 65536 parts of a count. */
#define TURN_TRAVEL (60000LL * 32768)

_Static_assert(CONFIG_SLOW_HZ == 1000,
               "the estimate counts in milliseconds, and takes them for slow periods; so does KI");

static void tune_estimate(const struct params *p, struct tuning *t)
{
    t->encoder_counts = p->encoder_counts;
    t->travel_per_count_q12 = (int32_t)scale(TURN_TRAVEL / 256 * 4096, 1, p->encoder_counts);
    t->counts_per_travel_q16 = (int32_t)scale(p->encoder_counts, 65536LL * 65536, TURN_TRAVEL);
    t->rpm_q4_per_w_q32 = (int32_t)(60LL * 16 * t->loop_hz / p->pole_pairs);
}

/* As a current: T / (1.5 p psi). More than a quarter of the largest is not friction to feed forward. */
static int32_t friction_q15(const struct params *p, const struct tuning *t, int64_t flux_current_e3)
{
    return scale_clamp(scale(p->friction_unm, FRICTION, flux_current_e3), 0, t->i_max_q15 / FRICTION_MOST_PART);
}

static int64_t kp_of(const struct params *p, int64_t inertia_gmm2, int64_t flux_current_e3)
{
    return scale(inertia_gmm2 * p->speed_bw_hz, KP_E3, flux_current_e3);
}

static int64_t accel_of(int64_t inertia_gmm2, int64_t flux_current_e3)
{
    return scale(inertia_gmm2, ACCEL_E6 / 1000 * CONFIG_SLOW_HZ, flux_current_e3);
}

/* The nearest inertia whose gains fit. */
static struct outcome another_inertia(const struct params *p, bool more, int64_t flux_current_e3)
{
    const int64_t kp = kp_of(p, INERTIA_MOST, flux_current_e3), accel = accel_of(INERTIA_MOST, flux_current_e3);
    return tuning_instead(ERROR_SPEED_GAIN, INERTIA_MOST, more ? 1 : INT32_MAX - 1LL, more || kp > accel ? kp : accel);
}

static struct outcome tune_speed_gains(const struct params *p, struct tuning *t)
{
    const int64_t flux_current_e3 = p->pole_pairs * mtpa_flux_nwb(p) * p->i_range_ma; /* below 2^62: tuning_torque() */
    const int64_t inertia_hz = (int64_t)p->inertia_gmm2 * p->speed_bw_hz;
    const int64_t kp = kp_of(p, p->inertia_gmm2, flux_current_e3);
    const int64_t ki = scale(inertia_hz * p->speed_bw_hz, KI, flux_current_e3);
    const int64_t accel = accel_of(p->inertia_gmm2, flux_current_e3);
    if (kp < 1 || kp > INT32_MAX || accel > INT32_MAX) {
        return another_inertia(p, kp < 1, flux_current_e3);
    }
    const int64_t edges =
        source_has((uint32_t)p->angle_source, SOURCE_SWITCHES) ? 6 * p->pole_pairs : p->encoder_counts;
    const int64_t ki_min = scale(t->i_max_q15 * edges, 65536LL * 2048, COUNT_WEIGHS * TURN_TRAVEL);
    t->speed_kp_q16 = (int32_t)kp;
    t->speed_ki_q16 = (int32_t)ki;
    t->speed_ki_min_q16 = source_has((uint32_t)p->angle_source, SOURCE_ESTIMATES)
                              ? 0
                              : scale_clamp(ki_min, 0, (int32_t)ki); /* no edges */
    t->speed_accel_q8 = (int32_t)accel;
    t->friction_q15 = friction_q15(p, t, flux_current_e3);
    t->torque_mean_ms = p->torque_mean_ms;
    t->ramp_q16 = (int32_t)scale(p->ramp_rpm_s, 65536, CONFIG_SLOW_HZ);
    return OUTCOME_OK;
}

struct outcome tuning_speed(const struct params *p, struct tuning *t)
{
    const struct outcome problem = tune_speed_gains(p, t);
    if (problem.error == ERROR_NONE) {
        tune_estimate(p, t);
    }
    return problem;
}

/* ==== position ==== */

/*
 * Units and gains of the position loop and the profile. A unit is 2^-shift counts: the smallest with which speed_max is at most
 * UNITS_MOST units a millisecond, but not below 2^-SHIFT_MOST. The sum of PARAM_JERK_MOST_MS such speeds stays below 2^30.
 */

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

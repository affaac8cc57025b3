/* SPDX-License-Identifier: MIT */
/*
 * Gains of the speed loop and units of the speed estimate. The plant is Kt/(sJ) with Kt = 1.5 p psi for currents in peak
 * amperes and psi as in mtpa.h, so Kp = w J / Kt; the integral acts below a quarter of the crossover.
 */
#include "firmware/settings/config.h"
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
    const int64_t edges = p->angle_source == PARAM_ANGLE_HALL ? 6 * p->pole_pairs : p->encoder_counts;
    const int64_t ki_min = scale(t->i_max_q15 * edges, 65536LL * 2048, COUNT_WEIGHS * TURN_TRAVEL);
    t->speed_kp_q16 = (int32_t)kp;
    t->speed_ki_q16 = (int32_t)ki;
    t->speed_ki_min_q16 =
        p->angle_source == PARAM_ANGLE_SENSORLESS ? 0 : scale_clamp(ki_min, 0, (int32_t)ki); /* no edges */
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

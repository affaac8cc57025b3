/* SPDX-License-Identifier: MIT */
#include "firmware/settings/tuning.h"

#include <stdbool.h>

#include "firmware/settings/config.h"
#include "lib/polar.h"

/*
 * Current loop. The plant of one axis is 1/(R + sL); a PI whose zero cancels that pole leaves an integrator of crossover
 * w = 2 pi f:  Kp = w L,  Ki = w R  (for example Harnefors, Nee: "Model-based current control of AC machines using the
 * internal model control method", IEEE Trans. Ind. Appl. 34(1), 1998). Speed loop: the plant is Kt/(sJ), so
 * Kp = w J / Kt with Kt = 1.5 p psi for currents in peak amperes; the integral acts below a quarter of the crossover.
 *
 * Constants below are 2 pi times powers of ten and two, scaled to integers; each line says from what.
 */
#define TWO_PI_E9          6283185307LL
#define FOUR_PI_SQUARED_E9 39478417604LL

#define GAIN_LIMIT 32767 /* gains are 16 bit, to be multiplied with 16-bit values */

/* a * b / c, rounded to nearest, for positive values whose product fits 63 bits */
static int64_t scale(int64_t a, int64_t b, int64_t c)
{
    return (a * b + c / 2) / c;
}

int32_t tuning_q15_from_milli(int32_t milli, int32_t range_milli)
{
    const int64_t magnitude = scale(milli < 0 ? -(int64_t)milli : milli, 32768, range_milli);
    return (int32_t)(milli < 0 ? -magnitude : magnitude);
}

int32_t tuning_milli_from_q15(int32_t q15, int32_t range_milli)
{
    return (int32_t)(((int64_t)q15 * range_milli + 16384) >> 15);
}

/* The reactance w L, w = 2 pi f, as a fraction of v_range/i_range times `one`. */
static int64_t reactance(const struct params *p, int32_t inductance_uh, int32_t frequency_hz, int64_t one)
{
    /* ohm * 1e9 = 2 pi 1e9 * f * L_uH / 1e6 */
    const int64_t nano_ohm = scale(TWO_PI_E9 / 1000, (int64_t)inductance_uh * frequency_hz, 1000);
    const int64_t base_nano_ohm = scale(p->v_range_mv, 1000000000, p->i_range_ma);
    return scale(nano_ohm, one, base_nano_ohm);
}

static enum error tune_current_loop(const struct params *p, struct tuning *t)
{
    const int64_t kp_d = reactance(p, p->ld_uh, p->current_bw_hz, 1 << 12);
    const int64_t kp_q = reactance(p, p->lq_uh, p->current_bw_hz, 1 << 12);
    if (kp_d > GAIN_LIMIT || kp_q > GAIN_LIMIT) {
        return ERROR_CURRENT_GAIN;
    }
    /* Ki Ts per unit: 2 pi f R / f_pwm * i_range / v_range */
    const int64_t nano_ohm = scale(TWO_PI_E9 / 1000, (int64_t)p->resistance_mohm * p->current_bw_hz, CONFIG_PWM_HZ);
    const int64_t ki = scale(nano_ohm, 1 << 17, scale(p->v_range_mv, 1000000000, p->i_range_ma));
    if (ki > GAIN_LIMIT || ki < 1) {
        return ERROR_CURRENT_INTEGRAL_GAIN;
    }
    const int64_t x_d = reactance(p, p->ld_uh, TUNING_SPEED_BASE_HZ, 1 << 11);
    const int64_t x_q = reactance(p, p->lq_uh, TUNING_SPEED_BASE_HZ, 1 << 11);
    /* volt * 1e6 = 2 pi f psi_uwb */
    const int64_t emf = scale(scale(TWO_PI_E9 / 1000, (int64_t)p->flux_uwb * TUNING_SPEED_BASE_HZ, 1000000), 4096,
                              (int64_t)p->v_range_mv * 1000);
    if (x_d > GAIN_LIMIT || x_q > GAIN_LIMIT || emf > GAIN_LIMIT) {
        return ERROR_DECOUPLING;
    }
    t->kp_d_q12 = (int32_t)kp_d;
    t->kp_q_q12 = (int32_t)kp_q;
    t->ki_q17 = (int32_t)ki;
    t->x_d_q11 = (int32_t)x_d;
    t->x_q_q11 = (int32_t)x_q;
    t->emf_q12 = (int32_t)emf;
    return ERROR_NONE;
}

static enum error tune_speed_loop(const struct params *p, struct tuning *t)
{
    const int64_t omega_e3 = TWO_PI_E9 / 1000000 * p->speed_bw_hz; /* rad/s * 1000 */
    /* J in 1e-7 kg m^2 over Kt in 1e-9 N m/A is A/(rad/s^2) * 100 */
    const int64_t kt_nnm = 1500LL * p->pole_pairs * p->flux_uwb;
    const int64_t na_per_rad_s2 = scale(p->inertia_gcm2, 100000000000LL, kt_nnm);
    if (na_per_rad_s2 > 10000000000LL) { /* 10 A for 1 rad/s^2; larger values would overflow below */
        return ERROR_SPEED_GAIN;
    }
    const int64_t na_per_rpm_s = scale(na_per_rad_s2, 104719755, 1000000000); /* 2 pi / 60 */
    const int64_t na_per_rpm = scale(na_per_rpm_s, omega_e3, 1000);
    /* nA -> Q15, rpm -> Q4, and 16 fraction bits; both sides divided by 64 to stay inside 63 bits */
    const int64_t range_na_64 = (int64_t)p->i_range_ma * 1000000 / 64;
    const int64_t kp = scale(na_per_rpm, 32768LL * 65536 / 16 / 64, range_na_64);
    /* rpm Q16 per millisecond -> current in Q15 with 16 fraction bits: 1000 * 32768, and Q8 */
    const int64_t accel = scale(na_per_rpm_s, 32768LL * 1000 * 256 / 64, range_na_64);
    if (kp < 1 || kp > INT32_MAX || accel > INT32_MAX) {
        return ERROR_SPEED_GAIN;
    }
    t->speed_kp_q16 = (int32_t)kp;
    t->speed_ki_q16 = (int32_t)scale(kp, omega_e3, 4LL * 1000 * CONFIG_SLOW_HZ);
    t->speed_accel_q8 = (int32_t)accel;
    t->ramp_q16 = (int32_t)scale(p->ramp_rpm_s, 65536, CONFIG_SLOW_HZ);
    t->rpm_q4_per_w_q32 = (int32_t)(60LL * 16 * CONFIG_PWM_HZ / p->pole_pairs);
    return ERROR_NONE;
}

/* Above this share of psi / (Lq - Ld) reluctance takes too much of the magnets' pull. */
#define ALIGN_SALIENCY_MOST_Q15 16384

/* An i_align so far below i_max says that more would turn the magnets away: then there is no more. */
#define ALIGN_RANGE 4

#define ALIGN_LEAST_MS 20      /* a quicker rotor is led slowly enough as well */
#define ALIGN_MOST_MS2 2250000 /* 1.5 s: two and a half times that is the longest swing that is waited for */

/* The rotor swings about a field of current I with w0^2 = p Kt I / J. */
static int32_t align_period_ms(const struct params *p, int64_t i_ma)
{
    const int64_t kt_nnm = 1500LL * p->pole_pairs * p->flux_uwb;
    const int64_t w0_squared_e3 = scale(kt_nnm / 100, p->pole_pairs * i_ma, p->inertia_gcm2); /* (rad/s)^2 * 1000 */
    const int64_t period_squared_ms2 = FOUR_PI_SQUARED_E9 / (w0_squared_e3 < 1 ? 1 : w0_squared_e3);
    const int32_t period_ms =
        polar_root_down((uint32_t)(period_squared_ms2 > ALIGN_MOST_MS2 ? ALIGN_MOST_MS2 : period_squared_ms2));
    return period_ms < ALIGN_LEAST_MS ? ALIGN_LEAST_MS : period_ms;
}

static struct tuning_align align_level(const struct params *p, int64_t i_ma, int32_t ratio_q15)
{
    const int64_t difference_uh = p->lq_uh > p->ld_uh ? p->lq_uh - p->ld_uh : 0;
    const int64_t saliency_q15 = scale(difference_uh * i_ma, 32768, p->flux_uwb * 1000LL);
    const int32_t i_q15 = tuning_q15_from_milli((int32_t)i_ma, p->i_range_ma);
    return (struct tuning_align){
        .i_q15 = i_q15,
        .i_less_q15 = (i_q15 * ratio_q15) >> 15,
        .ratio_q15 = ratio_q15,
        .saliency_q15 = (int32_t)(saliency_q15 > ALIGN_SALIENCY_MOST_Q15 ? ALIGN_SALIENCY_MOST_Q15 : saliency_q15),
        .period_ms = align_period_ms(p, i_ma),
    };
}

static int64_t largest_align_ma(const struct params *p)
{
    const int64_t difference_uh = p->lq_uh - p->ld_uh;
    const int64_t turns_away_ma = difference_uh > 0 ? (int64_t)p->flux_uwb * 500 / difference_uh : p->i_max_ma;
    const int64_t most_ma = (int64_t)p->i_align_ma * ALIGN_RANGE < p->i_max_ma ? p->i_align_ma : p->i_max_ma;
    return most_ma < turns_away_ma ? most_ma : turns_away_ma;
}

/* A tenth of i_trip: with one sensor reversed the sum of the currents is twice that, and trips at a quarter. */
static void tune_wiring(const struct params *p, struct tuning *t)
{
    t->wiring_i_q15 = tuning_q15_from_milli(p->i_trip_ma / 10, p->i_range_ma);
    const int64_t drop_mv = scale(p->i_trip_ma / 10, p->resistance_mohm, 1000);
    t->wiring_v_q15 = tuning_q15_from_milli((int32_t)(drop_mv < p->v_range_mv ? drop_mv : p->v_range_mv), p->v_range_mv);
}

static void tune_alignment(const struct params *p, struct tuning *t)
{
    const int64_t most_ma = largest_align_ma(p);
    t->pole_pairs = p->pole_pairs;
    t->encoder_counts = p->encoder_counts;
    t->align_levels = most_ma > p->i_align_ma ? 2u : 1u;
    t->align[0] = align_level(p, p->i_align_ma, 16384);
    t->align[1] = align_level(p, most_ma, 19661); /* 0.6: a load of half of i_max is held with it as well */
}

static enum error check_limits(const struct params *p)
{
    const int64_t range = p->i_range_ma;
    if (p->i_trip_ma > range * 95 / 100) {
        return ERROR_I_TRIP_BEYOND_RANGE;
    }
    if (p->i_max_ma > p->i_trip_ma * 85LL / 100) {
        return ERROR_I_MAX_BEYOND_TRIP;
    }
    if (p->i_align_ma > p->i_max_ma) {
        return ERROR_I_ALIGN_BEYOND_MAX;
    }
    if (p->v_min_mv >= p->v_max_mv || p->v_max_mv > p->v_range_mv * 98LL / 100) {
        return ERROR_V_LIMITS;
    }
    if (p->speed_max_rpm >= p->overspeed_rpm) {
        return ERROR_SPEED_MAX_BEYOND_OVERSPEED;
    }
    if (p->v_min_mv < p->v_range_mv / 4) {
        return ERROR_V_MIN_BELOW_MODULATOR;
    }
    if ((int64_t)p->overspeed_rpm * p->pole_pairs > 60LL * TUNING_SPEED_BASE_HZ * 95 / 100) {
        return ERROR_SPEED_BEYOND_OBSERVER;
    }
    return ERROR_NONE;
}

struct outcome tuning_compute(const struct params *p, struct tuning *t)
{
    enum error problem = check_limits(p);
    if (problem == ERROR_NONE) {
        problem = tune_current_loop(p, t);
    }
    if (problem == ERROR_NONE) {
        problem = tune_speed_loop(p, t);
    }
    if (problem != ERROR_NONE) {
        return outcome_of(problem);
    }
    tune_alignment(p, t);
    tune_wiring(p, t);
    t->i_trip_q15 = tuning_q15_from_milli(p->i_trip_ma, p->i_range_ma);
    t->i_max_q15 = tuning_q15_from_milli(p->i_max_ma, p->i_range_ma);
    t->i_sum_q15 = t->i_trip_q15 / 4;
    t->v_min_q15 = tuning_q15_from_milli(p->v_min_mv, p->v_range_mv);
    t->v_max_q15 = tuning_q15_from_milli(p->v_max_mv, p->v_range_mv);
    t->overspeed_w_q15 = (int32_t)scale((int64_t)p->overspeed_rpm * p->pole_pairs, 32768, 60LL * TUNING_SPEED_BASE_HZ);
    t->encoder_scale_q32 =
        (uint32_t)((((uint64_t)p->pole_pairs << 32) + (uint32_t)p->encoder_counts / 2u) / (uint32_t)p->encoder_counts);
    return OUTCOME_OK;
}

/* SPDX-License-Identifier: MIT */
#include "firmware/settings/tuning.h"

#include <stdbool.h>

#include "firmware/settings/config.h"
#include "firmware/settings/mtpa.h"
#include "lib/polar.h"

/*
 * Current loop. The plant of one axis is 1/(R + sL); a PI whose zero cancels that pole leaves an integrator of crossover
 * w = 2 pi f:  Kp = w L,  Ki = w R  (for example Harnefors, Nee: "Model-based current control of AC machines using the
 * internal model control method", IEEE Trans. Ind. Appl. 34(1), 1998). Speed loop: the plant is Kt/(sJ), so
 * Kp = w J / Kt with Kt = 1.5 p psi for currents in peak amperes, psi as mtpa.h has it; the integral acts below a quarter of
 * the crossover.
 *
 * Constants below are 2 pi times powers of ten and two, scaled to integers; each line says from what.
 */
#define TWO_PI_E9 6283185307LL

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
    const int64_t x_d = reactance(p, p->ld_uh, CONFIG_SPEED_BASE_HZ, 1 << 11);
    const int64_t x_q = reactance(p, p->lq_uh, CONFIG_SPEED_BASE_HZ, 1 << 11);
    /* volt * 1e6 = 2 pi f psi_uwb */
    const int64_t emf = scale(scale(TWO_PI_E9 / 1000, (int64_t)p->flux_uwb * CONFIG_SPEED_BASE_HZ, 1000000), 4096,
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
    const int64_t kt_nnm = scale(3LL * p->pole_pairs, mtpa_flux_nwb(p), 2);
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

/*
 * During alignment the rotor swings about the field with w0^2 = Kt p I / J. The torque that damps it with D = 0.8 is 2 D w0 J
 * per rad/s: the share 2 D w0 / w of what the speed loop's gain w J would give.
 */
static void tune_alignment(const struct params *p, struct tuning *t)
{
    const int64_t kt_nnm = 1500LL * p->pole_pairs * p->flux_uwb;
    const int64_t w0_squared = scale(kt_nnm / 1000, (int64_t)p->pole_pairs * p->i_align_ma, 100LL * p->inertia_gcm2);
    const int32_t w0 = polar_root_down(w0_squared > UINT32_MAX ? UINT32_MAX : (uint32_t)w0_squared);
    const int64_t kp = scale(t->speed_kp_q16, mtpa_flux_nwb(p) / 1000, p->flux_uwb); /* reluctance does not help here */
    const int64_t kd = scale(kp > INT32_MAX ? INT32_MAX : kp, 1600LL * w0, TWO_PI_E9 / 1000000 * p->speed_bw_hz);
    t->align_kd_q16 = (int32_t)(kd > t->speed_kp_q16 ? t->speed_kp_q16 : kd);
}

#define BUS_SET_PERCENT 96 /* of v_max: see control/torque.h */

/* Energy in units of what a power of 1.0 brings in a slow period: C v_range / (3 i_range) per period. */
static void tune_torque(const struct params *p, struct tuning *t)
{
    const int64_t flux_nv = scale(mtpa_flux_nwb(p), TWO_PI_E9 / 1000000, 1000) * CONFIG_SPEED_BASE_HZ;
    const int64_t energy =
        scale((int64_t)p->bus_capacitance_uf * p->v_range_mv, 1024LL * CONFIG_SLOW_HZ, 3000000LL * p->i_range_ma);
    t->torque_emf_q11 = (int32_t)scale(flux_nv, 2048, 1000000LL * p->v_range_mv);
    t->bus_energy_q10 = (int32_t)(energy > GAIN_LIMIT ? GAIN_LIMIT : energy);
    const int32_t set_q15 = tuning_q15_from_milli(p->v_max_mv, p->v_range_mv) * BUS_SET_PERCENT / 100;
    t->bus_set_energy_q25 = ((set_q15 * set_q15) >> 15) * t->bus_energy_q10;
    const int64_t cancelling_q15 = scale((int64_t)t->emf_q12 * 32768, 1, 2LL * (t->x_d_q11 > 0 ? t->x_d_q11 : 1));
    t->burn_max_q15 = (int32_t)(cancelling_q15 < t->i_max_q15 ? cancelling_q15 : t->i_max_q15);
    t->speed_max_rpm_q4 = p->speed_max_rpm * 16;
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
    if ((int64_t)p->overspeed_rpm * p->pole_pairs > 60LL * CONFIG_SPEED_BASE_HZ * 95 / 100) {
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
    t->encoder_counts = p->encoder_counts;
    t->speed_per_count = (uint32_t)scale(48000000000LL, 1, p->encoder_counts);
    t->way_per_count_q12 = (int32_t)scale(31457280000LL, 1, p->encoder_counts);
    t->count_per_way_q16 = (int32_t)scale(p->encoder_counts, 8388608, 3840000);
    tune_alignment(p, t);
    t->i_trip_q15 = tuning_q15_from_milli(p->i_trip_ma, p->i_range_ma);
    t->i_max_q15 = tuning_q15_from_milli(p->i_max_ma, p->i_range_ma);
    t->i_align_q15 = tuning_q15_from_milli(p->i_align_ma, p->i_range_ma);
    t->i_sum_q15 = t->i_trip_q15 / 4;
    t->v_min_q15 = tuning_q15_from_milli(p->v_min_mv, p->v_range_mv);
    t->v_max_q15 = tuning_q15_from_milli(p->v_max_mv, p->v_range_mv);
    t->overspeed_w_q15 = (int32_t)scale((int64_t)p->overspeed_rpm * p->pole_pairs, 32768, 60LL * CONFIG_SPEED_BASE_HZ);
    tune_torque(p, t);
    t->encoder_scale_q32 =
        (uint32_t)((((uint64_t)p->pole_pairs << 32) + (uint32_t)p->encoder_counts / 2u) / (uint32_t)p->encoder_counts);
    return OUTCOME_OK;
}

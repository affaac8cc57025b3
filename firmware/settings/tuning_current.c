/* SPDX-License-Identifier: MIT */
/*
 * Gains of the current loop. The plant of one axis is 1/(R + sL); a PI whose zero cancels that pole leaves an integrator of
 * crossover w = 2 pi f:  Kp = w L,  Ki = w R  (for example Harnefors, Nee: "Model-based current control of AC machines using
 * the internal model control method", IEEE Trans. Ind. Appl. 34(1), 1998).
 */
#include "firmware/settings/config.h"
#include "firmware/settings/delay.h"
#include "firmware/settings/mtpa.h"
#include "firmware/settings/scale.h"
#include "firmware/settings/tuning_parts.h"
#include "lib/deadtime.h"
#include "lib/q15.h"

#define RIPPLE_KNEES     4 /* below that the current loop copes, and the faster handler can be used */
#define REACTANCE_LIMIT  131071
#define IRON_GROWS_LIMIT 65535 /* times a square of a current: 32 bits */
#define Q15_UNITY        32768
#define GAIN_LIMIT       32767 /* gains are 16 bit, to be multiplied with 16-bit values */
#define KP_LIMIT         131071
#define RESISTANCE_MOST  100000 /* of the parameter */

_Static_assert((int64_t)KP_LIMIT *(CONFIG_BUS_STEPS / 8) <= INT32_MAX, "the current loop multiplies kp with so much");

static int64_t larger_of(int64_t x, int64_t y)
{
    return x > y ? x : y;
}

static int32_t largest_uh(const struct params *p)
{
    return (int32_t)larger_of(p->ld_uh, p->lq_uh);
}

/* Ki Ts: mohm are 1e-3 ohm, 2 pi has 3 decimals more. */
static int64_t integral(const struct params *p, const struct tuning *t, int32_t resistance_mohm)
{
    return scale((int64_t)resistance_mohm * p->current_bw_hz * p->i_range_ma, TWO_PI_E9 * (1 << 17) / 1000000,
                 (int64_t)p->v_range_mv * t->loop_hz * 1000000);
}

/* The reactance w L as a fraction of v_range/i_range, times `one`: uH are 1e-6 H, 2 pi has 6 decimals more. */
static int64_t reactance(const struct params *p, int32_t inductance_uh, int32_t frequency_hz, int64_t one)
{
    return scale((int64_t)inductance_uh * frequency_hz * p->i_range_ma, TWO_PI_E9 * one / 1000,
                 p->v_range_mv * 1000000000000LL);
}

static struct outcome tune_current_gains(const struct params *p, struct tuning *t)
{
    const int64_t kp_d = reactance(p, p->ld_uh, p->current_bw_hz, 1 << 12);
    const int64_t kp_q = reactance(p, p->lq_uh, p->current_bw_hz, 1 << 12);
    if (kp_d > KP_LIMIT || kp_q > KP_LIMIT) {
        return tuning_instead(ERROR_CURRENT_GAIN, largest_uh(p), KP_LIMIT - 1, larger_of(kp_d, kp_q));
    }
    const int64_t ki = integral(p, t, p->resistance_mohm);
    if (ki > GAIN_LIMIT || ki < 1) {
        return tuning_instead(ERROR_CURRENT_INTEGRAL_GAIN, RESISTANCE_MOST, ki < 1 ? 1 : GAIN_LIMIT - 1,
                              integral(p, t, RESISTANCE_MOST));
    }
    t->kp_d_q12 = (int32_t)kp_d;
    t->kp_q_q12 = (int32_t)kp_q;
    t->ki_q17 = (int32_t)ki;
    return OUTCOME_OK;
}

/*
 * In q, where reluctance machines saturate, 1 / L is assumed to grow with the square of the current: 1 / lq_rest at no current,
 * 1 / lq at rated. Along MTPA that is within 11 % for two machines with known maps, up to 1.2 times rated current
 * (tests/unit/test_iron.py).
 */
static void tune_iron(const struct params *p, struct tuning *t)
{
    const int32_t rated_q15 = tuning_q15_from_milli(p->i_rated_ma, p->i_range_ma);
    t->iron_rest_q15 = Q15_UNITY;
    t->iron_grows_q10 = 0;
    if (p->lq_rest_uh > p->lq_uh && rated_q15 > 0) {
        t->iron_rest_q15 = scale_clamp(scale(p->lq_uh, Q15_UNITY, p->lq_rest_uh), 1, Q15_UNITY); /* a divisor */
        const int64_t grows_q10 =
            scale((int64_t)(Q15_UNITY - t->iron_rest_q15) << 10, Q15_UNITY, (int64_t)rated_q15 * rated_q15);
        t->iron_grows_q10 = scale_clamp(grows_q10, 0, IRON_GROWS_LIMIT);
    }
}

static struct outcome tune_decoupling(const struct params *p, struct tuning *t)
{
    const int64_t x_d = reactance(p, p->ld_uh, CONFIG_SPEED_BASE_HZ, 1 << 11);
    const int64_t x_q = reactance(p, p->lq_uh, CONFIG_SPEED_BASE_HZ, 1 << 11);
    const int64_t apparent = reactance(p, mtpa_lq_uh(p), CONFIG_SPEED_BASE_HZ, 1 << 11);
    /* 2 pi f psi: uWb over mV are 1e-3, 2 pi has 6 decimals more */
    const int64_t emf =
        scale((int64_t)p->flux_uwb * CONFIG_SPEED_BASE_HZ, TWO_PI_E9 * 4096 / 1000, p->v_range_mv * 1000000000LL);
    const int64_t r = scale(p->resistance_mohm, 4096LL * p->i_range_ma, 1000LL * p->v_range_mv);
    if (x_d > REACTANCE_LIMIT || x_q > REACTANCE_LIMIT) {
        return tuning_instead(ERROR_CURRENT_GAIN, largest_uh(p), REACTANCE_LIMIT - 1, larger_of(x_d, x_q));
    }
    if (emf > GAIN_LIMIT) {
        return tuning_instead(ERROR_DECOUPLING, p->flux_uwb, GAIN_LIMIT - 1, emf);
    }
    if (r > GAIN_LIMIT) {
        return tuning_instead(ERROR_CURRENT_INTEGRAL_GAIN, p->resistance_mohm, GAIN_LIMIT - 1, r);
    }
    t->x_q_apparent_q11 = scale_clamp(apparent, 0, REACTANCE_LIMIT);
    t->x_d_q11 = (int32_t)x_d;
    t->x_q_q11 = (int32_t)x_q;
    t->emf_q12 = (int32_t)emf;
    t->r_q12 = (int32_t)r;
    return OUTCOME_OK;
}

/*
 * When a phase's voltage crosses zero, its leg switches in the middle of the interval in which the other two differ. Until then
 * both drive its current away with a third of the bus, for sqrt(3)/4 v/vbus of a period: by v T / L / (4 sqrt(3)). A smaller
 * current changes sign within the period, and dead time costs nothing (lib/deadtime.h).
 */
static void tune_ripple(const struct params *p, struct tuning *t)
{
    const int32_t least_uh = p->ld_uh < p->lq_uh ? p->ld_uh : p->lq_uh;
    const int64_t q10 = scale_clamp(
        scale(p->v_range_mv * 147801669LL, 1, (int64_t)least_uh * CONFIG_PWM_HZ * p->i_range_ma), 0, INT32_MAX);
    const int64_t largest_q15 = scale(q10 * 18919, p->v_max_mv, 1024LL * p->v_range_mv); /* v_max over sqrt(3) */
    t->ripple_q10 = largest_q15 < RIPPLE_KNEES * DEADTIME_KNEE_Q15 ? 0 : scale_clamp(q10, 0, GAIN_LIMIT);
}

void tuning_rates(const struct params *p, struct tuning *t)
{
    t->samples = p->pwm_samples;
    t->loop_hz = CONFIG_PWM_HZ * t->samples;
    t->loops_per_slow = CONFIG_PERIODS_PER_SLOW * t->samples;
    t->loop_counts = CONFIG_PWM_COUNTS / t->samples;
}

struct outcome tuning_current(const struct params *p, struct tuning *t)
{
    const struct outcome problem = tune_current_gains(p, t);
    t->update = (enum pwm_update)p->pwm_update;
    t->delay_halves = delay_halves(t->update, t->samples);
    tune_ripple(p, t);
    tune_iron(p, t);
    return problem.error != ERROR_NONE ? problem : tune_decoupling(p, t);
}

/* ==== torque ==== */

/* Inputs of the torque limits: largest flux, bus energy, power that may be burnt in the windings. */

#define LARGEST 32767 /* 16 bits, to be multiplied with 16-bit values */

#define SALIENCY_MOST 65535 /* times a current: 32 bits */

#define EMF_MOST 65535 /* times a speed or a torque, which have 15 bits and a sign */

#define POWER_MOST 65535 /* twice the ranges: no limit, and 16 bits can still shift by 15 */

/* Over 1.5 v_range i_range. */
static int32_t power_q15(const struct params *p, int32_t power_w)
{
    return scale_clamp(scale(power_w * 2000000LL, 32768, 3LL * p->v_range_mv * p->i_range_ma), 0, POWER_MOST);
}

/* Energy in units of a power of 1.0 over a slow period: C v_range / (3 i_range) per period. */
struct outcome tuning_torque(const struct params *p, struct tuning *t)
{
    const int64_t flux_nv = scale(mtpa_flux_nwb(p), TWO_PI_E9 / 1000000, 1000) * CONFIG_SPEED_BASE_HZ;
    const int64_t emf_q11 = scale(flux_nv, 2048, 1000000LL * p->v_range_mv);
    const int64_t energy =
        scale((int64_t)p->bus_capacitance_uf * p->v_range_mv, 1024LL * CONFIG_SLOW_HZ, 3000000LL * p->i_range_ma);
    if (emf_q11 > EMF_MOST) {
        return tuning_instead(ERROR_CURRENT_GAIN, mtpa_lq_uh(p) > mtpa_ld_uh(p) ? mtpa_lq_uh(p) : mtpa_ld_uh(p),
                              EMF_MOST - 1, emf_q11);
    }
    t->torque_emf_q11 = q15_max((int32_t)emf_q11, 1); /* a weak magnet's may be below one LSB, and divides */
    t->bus_energy_q10 = scale_clamp(energy, 0, LARGEST);
    const int32_t set_q15 = tuning_q15_from_milli(p->v_max_mv, p->v_range_mv) * TUNING_BUS_SET_PERCENT / 100;
    t->bus_set_energy_q25 = ((set_q15 * set_q15) >> 15) * t->bus_energy_q10;
    const int64_t x_d_q11 = (int64_t)t->x_d_q11 * mtpa_ld_uh(p) / p->ld_uh;
    const int64_t x_q_q11 = (int64_t)t->x_q_q11 * mtpa_lq_uh(p) / p->lq_uh;
    const int64_t cancelling_q15 = scale((int64_t)t->emf_q12 * 32768, 1, 2 * (x_d_q11 > 0 ? x_d_q11 : 1));
    t->saliency_q11 = scale_clamp(x_q_q11 - x_d_q11, -SALIENCY_MOST, SALIENCY_MOST);
    t->burn_max_q15 = scale_clamp(cancelling_q15, 0, t->i_max_q15);
    t->power_max_q15 = q15_max(power_q15(p, p->power_max_w), 1); /* a watt may be below one LSB */
    t->regen_max_q15 = power_q15(p, p->regen_max_w);
    t->speed_max_rpm_q4 = p->speed_max_rpm * 16;
    t->radius_steps = CONFIG_RADIUS_STEPS;
    t->weakens = false; /* until torque_build_step() has seen the bus */
    return OUTCOME_OK;
}

/* What the torque of i_max turns up to speed_max in five minutes: 1.5 p psi I 300 s / (2 pi / 60 rpm). */
static int64_t largest_gmm2(const struct params *p)
{
    return scale(p->pole_pairs * mtpa_flux_nwb(p) * p->i_max_ma, 4297183, 1000000LL * p->speed_max_rpm);
}

/* 60 / (2 pi sqrt(3)) = 5.51328895; mV over uWb are 1000 / s. */
struct outcome tuning_check_motor(const struct params *p)
{
    const int64_t rpm = scale(p->v_max_mv, 5513289, 1000LL * p->flux_uwb * p->pole_pairs);
    if (p->emf_beyond_v_max == 0 && rpm < p->overspeed_rpm) {
        return (struct outcome){ERROR_EMF_BEYOND_V_MAX, (int32_t)rpm};
    }
    const int64_t gmm2 = largest_gmm2(p);
    return p->inertia_gmm2 > gmm2 ? (struct outcome){ERROR_INERTIA, (int32_t)gmm2} : OUTCOME_OK;
}

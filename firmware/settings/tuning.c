/* SPDX-License-Identifier: MIT */
#include "firmware/settings/tuning.h"

#include "drivers/fabric/adc.h"
#include "firmware/settings/config.h"
#include "firmware/settings/features.h"
#include "firmware/settings/hall_table.h"
#include "firmware/settings/margins.h"
#include "firmware/settings/mtpa.h"
#include "firmware/settings/scale.h"
#include "firmware/settings/tuning_parts.h"
#include "lib/deadtime.h"
#include "lib/q15.h"

/* ==== current loop ==== */

/*
 * Gains of the current loop. The plant of one axis is 1/(R + sL); a PI whose zero cancels that pole leaves an integrator of
 * crossover w = 2 pi f:  Kp = w L,  Ki = w R  (for example Harnefors, Nee: "Model-based current control of AC machines using
 * the internal model control method", IEEE Trans. Ind. Appl. 34(1), 1998).
 */
#define RIPPLE_KNEES     4 /* below that the current loop corrects it, and the faster handler can be used */
#define REACTANCE_LIMIT  131071
#define IRON_GROWS_LIMIT 65535 /* times a square of a current: 32 bits */
#define Q15_UNITY        32768
#define GAIN_LIMIT       32767 /* gains are 16 bit, to be multiplied with 16-bit values */
#define KP_LIMIT         131071
#define RESISTANCE_MAX   100000 /* of the parameter */

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
        return tuning_instead(ERROR_CURRENT_INTEGRAL_GAIN, RESISTANCE_MAX, ki < 1 ? 1 : GAIN_LIMIT - 1,
                              integral(p, t, RESISTANCE_MAX));
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
    const int32_t min_uh = p->ld_uh < p->lq_uh ? p->ld_uh : p->lq_uh;
    const int64_t q10 = scale_clamp(
        scale(p->v_range_mv * 147801669LL, 1, (int64_t)min_uh * CONFIG_PWM_HZ * p->i_range_ma), 0, INT32_MAX);
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

/* Inputs of the torque limits: largest flux, bus energy, power that may be dissipated in the windings. */

#define LARGEST 32767 /* 16 bits, to be multiplied with 16-bit values */

#define SALIENCY_MAX 65535 /* times a current: 32 bits */

#define EMF_MAX 65535 /* times a speed or a torque, which have 15 bits and a sign */

#define POWER_MAX 65535 /* twice the ranges: no limit, and 16 bits can still shift by 15 */

/* Over 1.5 v_range i_range. */
static int32_t power_q15(const struct params *p, int32_t power_w)
{
    return scale_clamp(scale(power_w * 2000000LL, 32768, 3LL * p->v_range_mv * p->i_range_ma), 0, POWER_MAX);
}

/* Energy in units of a power of 1.0 over a slow period: C v_range / (3 i_range) per period. */
struct outcome tuning_torque(const struct params *p, struct tuning *t)
{
    const int64_t flux_nv = scale(mtpa_flux_nwb(p), TWO_PI_E9 / 1000000, 1000) * CONFIG_SPEED_BASE_HZ;
    const int64_t emf_q11 = scale(flux_nv, 2048, 1000000LL * p->v_range_mv);
    const int64_t energy =
        scale((int64_t)p->bus_capacitance_uf * p->v_range_mv, 1024LL * CONFIG_SLOW_HZ, 3000000LL * p->i_range_ma);
    if (emf_q11 > EMF_MAX) {
        return tuning_instead(ERROR_CURRENT_GAIN, mtpa_lq_uh(p) > mtpa_ld_uh(p) ? mtpa_lq_uh(p) : mtpa_ld_uh(p),
                              EMF_MAX - 1, emf_q11);
    }
    t->torque_emf_q11 = q15_max((int32_t)emf_q11, 1); /* a weak magnet's may be below one LSB, and divides */
    t->bus_energy_q10 = scale_clamp(energy, 0, LARGEST);
    const int32_t set_q15 = tuning_q15_from_milli(p->v_max_mv, p->v_range_mv) * TUNING_BUS_SET_PERCENT / 100;
    t->bus_set_energy_q25 = ((set_q15 * set_q15) >> 15) * t->bus_energy_q10;
    const int64_t x_d_q11 = (int64_t)t->x_d_q11 * mtpa_ld_uh(p) / p->ld_uh;
    const int64_t x_q_q11 = (int64_t)t->x_q_q11 * mtpa_lq_uh(p) / p->lq_uh;
    const int64_t cancelling_q15 = scale((int64_t)t->emf_q12 * 32768, 1, 2 * (x_d_q11 > 0 ? x_d_q11 : 1));
    t->saliency_q11 = scale_clamp(x_q_q11 - x_d_q11, -SALIENCY_MAX, SALIENCY_MAX);
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

/* ==== all of it, checked ==== */

/* From the trigger to the last compare: bits, filter, arithmetic and handler. */
static int32_t modulator_counts(int32_t osr)
{
    return 3 * osr * ADC_MODULATOR_CLOCKS + 300;
}

/* The first whose condition holds is reported. */
struct inconsistency {
    bool holds;
    enum error error;
    int64_t value; /* the limit, where the text names one */
};

static struct outcome first_of(const struct inconsistency *list, size_t count)
{
    for (size_t n = 0; n < count; n++) {
        if (list[n].holds) {
            return (struct outcome){list[n].error, (int32_t)list[n].value};
        }
    }
    return OUTCOME_OK;
}

/*
 * Inductances of the same iron: by how much saturation at rated current may bring the incremental ones below flux over
 * current, and below those without current. Motors with measured maps have 3.8 and 6.8 (qemu/motors/thor_pmsyrm.toml).
 */
#define APPARENT_MAX 8LL
#define REST_MAX     16LL

static struct outcome check_limits(const struct params *p)
{
    const int64_t trip_limit_ma = p->i_range_ma * 95LL / 100;
    const int64_t max_limit_ma = p->i_trip_ma * 85LL / 100;
    const int64_t v_limit_mv = p->v_range_mv * 98LL / 100;
    const int64_t rpm_limit = 60LL * CONFIG_SPEED_BASE_HZ * 95 / 100 / p->pole_pairs;
    const struct inconsistency list[] = {
        {p->i_trip_ma > trip_limit_ma, ERROR_I_TRIP_BEYOND_RANGE, trip_limit_ma},
        {p->i_max_ma > max_limit_ma, ERROR_I_MAX_BEYOND_TRIP, max_limit_ma},
        {p->i_align_ma > p->i_max_ma, ERROR_I_ALIGN_BEYOND_MAX, p->i_max_ma},
        {p->v_min_mv >= p->v_max_mv || p->v_max_mv > v_limit_mv, ERROR_V_LIMITS, v_limit_mv},
        {p->chopper_on_mv != 0 && (p->chopper_on_mv >= p->v_max_mv || p->chopper_off_mv == 0 ||
                                   p->chopper_off_mv > p->chopper_on_mv - p->v_range_mv / 1000),
         ERROR_CHOPPER_LEVELS, 0},
        {p->speed_max_rpm >= p->overspeed_rpm, ERROR_SPEED_MAX_BEYOND_OVERSPEED, p->overspeed_rpm - 1},
        {p->v_min_mv < p->v_range_mv / 4, ERROR_V_MIN_BELOW_MODULATOR, p->v_range_mv / 4},
        {p->overspeed_rpm > rpm_limit, ERROR_SPEED_BEYOND_OBSERVER, rpm_limit},
        {p->ld_apparent_uh > APPARENT_MAX * p->ld_uh, ERROR_LD_APPARENT, APPARENT_MAX * p->ld_uh},
        {p->lq_apparent_uh > APPARENT_MAX * p->lq_uh, ERROR_LQ_APPARENT, APPARENT_MAX * p->lq_uh},
        {p->lq_rest_uh > REST_MAX * p->lq_uh, ERROR_LQ_REST, REST_MAX * p->lq_uh},
    };
    return first_of(list, sizeof list / sizeof list[0]);
}

static struct outcome check_sampling(const struct params *p)
{
    const bool shunts = p->low_side_shunts != 0;
    const bool twice = p->pwm_samples != 1;
    const int32_t osr = p->modulator_osr;
    const struct inconsistency list[] = {
        {shunts && p->overmodulation != 0, ERROR_OVERMODULATION_OF_SHUNTS, 0},
        {shunts && twice, ERROR_SAMPLES_OF_SHUNTS, 0},
        {twice && p->pwm_update == PWM_UPDATE_VALLEY, ERROR_SAMPLES_AT_VALLEY, 0},
        {twice && p->pwm_samples * CONFIG_PWM_HZ > CONFIG_LOOP_HZ_MAX, ERROR_SAMPLES_TOO_FAST, 0},
        {osr != 0 && (osr < 32 || (osr & (osr - 1)) != 0), ERROR_MODULATOR_OSR, 0},
        {osr != 0 && shunts, ERROR_MODULATOR_OF_SHUNTS, 0},
        {osr != 0 && modulator_counts(osr) > CONFIG_PWM_COUNTS / p->pwm_samples, ERROR_MODULATOR_TOO_SLOW, 0},
    };
    return first_of(list, sizeof list / sizeof list[0]);
}

/*
 * The fast path has fewer bits and more noise: a sixteenth of the range is kept for it. Beyond 95 % no modulator is reliable.
 */
static void tune_sensors(const struct params *p, struct tuning *t)
{
    const int32_t trip_q15 = t->i_trip_q15 + 32768 / 16, limit_q15 = 32768 * 95 / 100;
    t->modulator_osr = (int16_t)p->modulator_osr;
    t->settle_counts = p->low_side_shunts != 0 ? CONFIG_SETTLE_COUNTS : 0u;
    t->modulator_trip_q15 = trip_q15 < limit_q15 ? trip_q15 : limit_q15;
    t->early_counts = 3 * p->modulator_osr * ADC_MODULATOR_CLOCKS / 2;
}

/* Before the speed loop's gains, which depend on the limits. */
static void tune_limits(const struct params *p, struct tuning *t)
{
    t->i_trip_q15 = tuning_q15_from_milli(p->i_trip_ma, p->i_range_ma);
    t->i_max_q15 = tuning_q15_from_milli(p->i_max_ma, p->i_range_ma);
    tune_sensors(p, t);
    t->i_sum_q15 = t->i_trip_q15 / 4;
    t->v_min_q15 = tuning_q15_from_milli(p->v_min_mv, p->v_range_mv);
    t->v_max_q15 = tuning_q15_from_milli(p->v_max_mv, p->v_range_mv);
    t->chopper_on_q15 = tuning_q15_from_milli(p->chopper_on_mv, p->v_range_mv);
    t->chopper_off_q15 = tuning_q15_from_milli(p->chopper_off_mv, p->v_range_mv);
    t->overspeed_w_q15 = (int32_t)scale((int64_t)p->overspeed_rpm * p->pole_pairs, 32768, 60LL * CONFIG_SPEED_BASE_HZ);
    t->encoder_scale_q32 = (uint32_t)scale(p->pole_pairs, 1LL << 32, p->encoder_counts);
}

/* Checks the bandwidths' margins and the encoder's resolution. */
static struct outcome check_margins(const struct params *p, struct tuning *t)
{
    const bool counts = source_has((uint32_t)p->angle_source, SOURCE_COUNTS);
    const int32_t current_bw_hz = margin_current_bw_hz(t->update, t->samples);
    if (p->current_bw_hz > current_bw_hz) {
        return (struct outcome){ERROR_CURRENT_MARGIN, current_bw_hz};
    }
    t->current_margin_u16 = margin_of_current_u16(p->current_bw_hz, t->update, t->samples);
    const int32_t min_counts = MARGIN_COUNTS_A_POLE_PAIR * p->pole_pairs;
    if (counts && p->encoder_counts < min_counts) {
        return (struct outcome){ERROR_ENCODER_COARSE, min_counts};
    }
    const int32_t resolved_hz = margin_resolution_bw_hz(p, t);
    if (counts && p->speed_bw_hz > resolved_hz) {
        return resolved_hz < 1 ? outcome_of(ERROR_SPEED_UNRESOLVED)
                               : (struct outcome){ERROR_SPEED_RESOLUTION, resolved_hz};
    }
    const int32_t speed_bw_hz = margin_speed_bw_hz(p->current_bw_hz, p->torque_mean_ms);
    if (p->speed_bw_hz > speed_bw_hz) {
        return speed_bw_hz < 1 ? outcome_of(ERROR_CURRENT_TOO_SLOW) : (struct outcome){ERROR_SPEED_MARGIN, speed_bw_hz};
    }
    if (p->position_bw_hz != 0 && p->position_bw_hz > margin_position_bw_hz(p)) {
        return (struct outcome){ERROR_POSITION_MARGIN, margin_position_bw_hz(p)};
    }
    return OUTCOME_OK;
}

struct outcome tuning_compute(const struct params *p, struct tuning *t)
{
    struct outcome found = check_limits(p);
    if (found.error == ERROR_NONE) {
        found = check_sampling(p);
    }
    if (found.error == ERROR_NONE) {
        tuning_rates(p, t);
        tune_limits(p, t);
        found = tuning_current(p, t);
    }
    if (found.error == ERROR_NONE) {
        found = tuning_torque(p, t);
    }
    if (found.error == ERROR_NONE) {
        found = tuning_speed(p, t);
    }
    if (found.error != ERROR_NONE) {
        return found;
    }
    tuning_position(p, t);
    tuning_start(p, t);
    struct hall_table hall;
    enum error problem = FEATURE_IN(HALL) ? hall_table_of(p, &hall) : ERROR_NONE;
    if (problem != ERROR_NONE && source_has((uint32_t)p->angle_source, SOURCE_SWITCHES)) {
        return outcome_of(problem);
    }
    problem = tuning_observer(p, t);
    if (problem != ERROR_NONE && source_has((uint32_t)p->angle_source, SOURCE_ESTIMATES)) {
        return outcome_of(problem);
    }
    const struct outcome absent = features_allow_source(p->angle_source); /* not before: the loops run by it even so */
    return absent.error != ERROR_NONE ? absent : check_margins(p, t);
}

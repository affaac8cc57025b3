/* SPDX-License-Identifier: MIT */
/* How the rotor's angle is found: currents and times of the start with an encoder, then the observer's model of the machine. */
#include "firmware/settings/config.h"
#include "firmware/settings/mtpa.h"
#include "firmware/settings/scale.h"
#include "firmware/settings/tuning_parts.h"
#include "lib/polar.h"
#include "lib/q15.h"

#define FOUR_PI_SQUARED_E9 39478417604LL

/* Above this share of psi / (Lq - Ld) reluctance reduces the magnets' torque too much. */
#define ALIGN_SALIENCY_MAX_Q15 16384

/* An i_align this far below i_max means that more current would turn the rotor away: use no more. */
#define ALIGN_RANGE 4

#define ALIGN_MIN_MS  30      /* slow enough for faster rotors, too */
#define ALIGN_MAX_MS2 2250000 /* 1.5 s: two and a half times that is the longest wait for an oscillation */

/* The peak-to-peak current of the saliency measurement, as a part of i_max, in a millisecond that it half settles. */
#define SALIENCY_I_PART 5
#define SALIENCY_US     900

/* The rotor oscillates about a field of current I with w0^2 = p Kt I / J. */
static int32_t align_period_ms(const struct params *p, int64_t i_ma)
{
    const int64_t kt_nnm = 1500LL * p->pole_pairs * p->flux_uwb;
    const int64_t w0_squared_e3 = scale(kt_nnm, p->pole_pairs * i_ma, p->inertia_gmm2); /* (rad/s)^2 * 1000 */
    const int64_t period_squared_ms2 = scale(FOUR_PI_SQUARED_E9, 1, w0_squared_e3 < 1 ? 1 : w0_squared_e3);
    return polar_root_down((uint32_t)scale_clamp(period_squared_ms2, ALIGN_MIN_MS * ALIGN_MIN_MS, ALIGN_MAX_MS2));
}

static int64_t larger(int64_t x, int64_t y)
{
    return x > y ? x : y;
}

/*
 * Lq - Ld as a rotor on the field sees it: nearly all of the current flows along the magnets, so the iron across them is not
 * saturated, however much it is at rated torque.
 */
static int64_t rest_difference_uh(const struct params *p)
{
    const int64_t lq_uh = larger(larger(p->lq_uh, p->lq_rest_uh), mtpa_lq_uh(p));
    const int64_t ld_uh = p->ld_uh < mtpa_ld_uh(p) ? p->ld_uh : mtpa_ld_uh(p);
    return larger(lq_uh - ld_uh, 0);
}

static struct tuning_align align_level(const struct params *p, int64_t i_ma, int32_t ratio_q15)
{
    const int64_t saliency_q15 = scale(rest_difference_uh(p) * i_ma, 32768, p->flux_uwb * 1000LL);
    const int32_t i_q15 = tuning_q15_from_milli((int32_t)i_ma, p->i_range_ma);
    return (struct tuning_align){
        .i_q15 = i_q15,
        .i_less_q15 = (i_q15 * ratio_q15) >> 15,
        .ratio_q15 = ratio_q15,
        .saliency_q15 = scale_clamp(saliency_q15, 0, ALIGN_SALIENCY_MAX_Q15),
        .period_ms = align_period_ms(p, i_ma),
    };
}

/*
 * Of psi / (Lq - Ld), in thousandths: the magnets then pull most firmly, but how firmly depends on that difference, and with
 * half of the current they pull nearly as much. Where the axis is not measured, less tells the load better.
 */
#define ALIGN_PERMILLE         500
#define ALIGN_PERMILLE_BY_LOAD 333

static int64_t largest_align_ma(const struct params *p, bool shows_axis)
{
    const int64_t difference_uh = rest_difference_uh(p);
    const int64_t permille = shows_axis ? ALIGN_PERMILLE : ALIGN_PERMILLE_BY_LOAD;
    const int64_t unstable_ma = difference_uh > 0 ? scale(p->flux_uwb, permille, difference_uh) : p->i_max_ma;
    const int64_t limit_ma = (int64_t)p->i_align_ma * ALIGN_RANGE < p->i_max_ma ? p->i_align_ma : p->i_max_ma;
    return larger(limit_ma < unstable_ma ? limit_ma : unstable_ma, 1);
}

/* ---- machines whose reluctance outweighs their magnets ---- */

static int64_t apparent_difference_uh(const struct params *p)
{
    const int64_t difference_uh = mtpa_lq_uh(p) - mtpa_ld_uh(p);
    return larger(difference_uh, 0);
}

/* The current as a multiple of psi / (Lq - Ld): the angle is then acos(1/3), and the rotor held twice as firmly. */
#define RELUCTANT_TIMES 3

/* From here on, aligning by the magnets' pull leaves them too little current. */
#define RELUCTANT_FROM_TENTHS 15

#define RELUCTANT_X_MIN_Q15 328 /* 0.01: almost no magnet */

/* Oscillation of a machine at the angle acos(x), x = psi / (Lq - Ld) I: w0^2 = p Kt I / J (1 - x^2) / x. */
static struct tuning_align reluctant_level(const struct params *p, int64_t i_ma)
{
    const int64_t seen_q15 = scale(p->flux_uwb * 1000LL, 32768, apparent_difference_uh(p) * i_ma);
    const int64_t x_q15 = seen_q15 > RELUCTANT_X_MIN_Q15 ? seen_q15 : RELUCTANT_X_MIN_Q15;
    const int64_t firmer_q15 = scale(32768LL * 32768 - x_q15 * x_q15, 1, x_q15);
    struct tuning_align level = align_level(p, i_ma, 32768);
    level.period_ms = align_period_ms(p, scale(i_ma, firmer_q15, 32768));
    return level;
}

/*
 * Where Lq is 1.35 times Ld an alternating voltage shows the axis within a degree, if the sensors agree to 1 %. That is better
 * than telling the load by two currents from where reluctance takes a third of the magnets' pull at i_max. A count is what the
 * axis is seen by: 2.8 degrees at most.
 */
#define AXIS_MIN_PERCENT 35
#define AXIS_PULL_PART   3
#define AXIS_COUNT_SHIFT 25

static bool shows_axis(const struct params *p, const struct tuning *t)
{
    const int64_t difference_uh = rest_difference_uh(p);
    return difference_uh * 100 >= (int64_t)p->ld_uh * AXIS_MIN_PERCENT &&
           t->encoder_scale_q32 >> AXIS_COUNT_SHIFT == 0u &&
           difference_uh * p->i_max_ma * AXIS_PULL_PART >= p->flux_uwb * 1000LL;
}

static void tune_saliency(const struct params *p, struct tuning *t)
{
    const bool used = t->reluctant || t->shows_axis;
    const int64_t v_mv = scale(p->ld_uh, p->i_max_ma / SALIENCY_I_PART, SALIENCY_US);
    t->saliency_i_q15 = used ? tuning_q15_from_milli(p->i_max_ma / SALIENCY_I_PART, p->i_range_ma) : 0;
    t->saliency_v_q15 = used ? tuning_q15_from_milli(scale_clamp(v_mv, 0, p->v_max_mv / 4), p->v_range_mv) : 0;
}

static void tune_reluctant(const struct params *p, struct tuning *t)
{
    const int64_t by_i_max = apparent_difference_uh(p) * p->i_max_ma; /* nWb */
    t->reluctant = by_i_max * 10 > p->flux_uwb * 1000LL * RELUCTANT_FROM_TENTHS;
    t->shows_axis = !t->reluctant && shows_axis(p, t);
    tune_saliency(p, t);
    if (!t->reluctant) {
        return;
    }
    const int64_t wanted_ma = scale(p->flux_uwb * 1000LL, RELUCTANT_TIMES, apparent_difference_uh(p));
    const int64_t i_ma = wanted_ma > p->i_max_ma / 4 ? wanted_ma : p->i_max_ma / 4 + 1;
    t->align[0] = reluctant_level(p, i_ma < p->i_max_ma ? i_ma : p->i_max_ma);
    t->align[1] = reluctant_level(p, p->i_max_ma);
    t->align_levels = i_ma < p->i_max_ma ? 2u : 1u;
}

/*
 * A tenth of i_trip: with one sensor reversed the sum of the currents is twice that, and trips at a quarter. A reluctance
 * machine gets less, because its large inductance holds the current longer: it must not be running when its axis is measured.
 */
#define WIRING_PART           10
#define WIRING_PART_RELUCTANT 30

static void tune_wiring(const struct params *p, struct tuning *t)
{
    const int32_t i_ma = p->i_trip_ma / (t->reluctant ? WIRING_PART_RELUCTANT : WIRING_PART);
    t->wiring_i_q15 = tuning_q15_from_milli(i_ma, p->i_range_ma);
    const int32_t drop_mv = scale_clamp(scale(i_ma, p->resistance_mohm, 1000), 0, p->v_range_mv);
    t->wiring_v_q15 = tuning_q15_from_milli(drop_mv, p->v_range_mv);
}

static void tune_alignment(const struct params *p, struct tuning *t)
{
    const int64_t limit_ma = largest_align_ma(p, shows_axis(p, t));
    const int64_t first_ma = p->i_align_ma < limit_ma ? p->i_align_ma : limit_ma;
    t->pole_pairs = p->pole_pairs;
    t->align_levels = limit_ma > first_ma ? 2u : 1u;
    t->align[0] = align_level(p, first_ma, 16384);
    t->align[1] = align_level(p, limit_ma, 19661); /* 0.6: it holds a load of half of i_max, too */
}

/*
 * At the start the limit is 1.6 % of speed_max, which with wrong counts or pole pairs may be 3.2 %; but a sixth of a turn per
 * oscillation period is allowed, or a low-speed motor would never come to rest. The encoder shows that speed by four counts.
 */
#define SPEED_PER_RPM_E3 1145325LL /* 1.6 % of a turn over 60000 ms, Q32 */
#define SWING_PART       6
#define SPEED_COUNTS     4
#define SPEED_PERIOD     8

static void tune_align_speed(const struct params *p, struct tuning *t)
{
    const int64_t limit_q32 = scale((int64_t)p->speed_max_rpm * p->pole_pairs, SPEED_PER_RPM_E3, 1000);
    const int64_t min_q32 = (1LL << 32) / (SWING_PART * t->align[0].period_ms);
    const int32_t limit_ms = t->align[0].period_ms / SPEED_PERIOD;
    t->align_speed_q32 = (int32_t)(limit_q32 > min_q32 ? limit_q32 : min_q32);
    const int64_t measured_ms = scale(SPEED_COUNTS, t->encoder_scale_q32, t->align_speed_q32);
    t->align_speed_ms = measured_ms < 1 ? 1 : measured_ms < limit_ms ? (int32_t)measured_ms : limit_ms;
}

void tuning_start(const struct params *p, struct tuning *t)
{
    tune_alignment(p, t);
    tune_align_speed(p, t);
    tune_reluctant(p, t);
    tune_wiring(p, t);
}

/* ==== without an encoder ==== */

/*
 * The machine model of the flux observer (control/observer.h). Its unit of flux, 2^28, is the sum of the magnets' flux and that
 * of i_range through the larger inductance. Inductances are flux over current: the apparent ones in saturated iron.
 */
#define R_MAX_Q5 32767 /* times a current of 65534 */

/*
 * The ramp may take 15 % of the largest current, leaving the rest for a load: rated load and this ramp together turn the rotor
 * about 55 degrees out of the field if i_max is 1.5 times rated.
 */
#define RAMP_PERCENT  15
#define ALIGN_PERIODS 5
#define ALIGN_MIN     300 /* ms */
#define ALIGN_MAX     2000

static void tune_field(const struct params *p, struct tuning *t)
{
    const int64_t slope_q16 = ((int64_t)t->i_max_q15 << 24) * RAMP_PERCENT / 100 / q15_max(t->speed_accel_q8, 1);
    const int32_t align_ms = ALIGN_PERIODS * t->align[0].period_ms;
    t->field.i_align_q15 = t->align[0].i_q15;
    t->field.align_ms = q15_clamp(align_ms, ALIGN_MIN, ALIGN_MAX);
    t->field.i_q15 = t->i_max_q15;
    t->field.ramp_q16 = scale_clamp(slope_q16, 1, t->ramp_q16);
    /* 2 zeta w: 0.7 2 pi a period; that of i_align; the field's own is slightly less */
    t->field.rest_ms = q15_max(t->align[0].period_ms, 1);
    t->field.yield_loops = scale_clamp((int64_t)t->field.rest_ms * t->loops_per_slow * 10 / 44 + 1, 1, INT32_MAX);
    /*
     * a field of up to 0.86 w catches a rotor at rest; it reaches 0.4 w in 0.3 of a turn, in whichever direction the rotor
     * sticks
     */
    const int64_t period_poles_ms = (int64_t)t->field.rest_ms * p->pole_pairs;
    t->field.creep_below_q16 = scale_clamp(24000LL * 65536 / period_poles_ms, 0, INT32_MAX);
    t->field.creep_q16 = scale_clamp(16000LL * 65536 / period_poles_ms / t->field.rest_ms + 1, 1, INT32_MAX);
    t->field.speed_per_rpm_q12 = (int32_t)scale(p->pole_pairs, 1 << 28, 60LL * t->loop_hz);
}

static int32_t rated_i_q20(const struct params *p)
{
    return scale_clamp(scale(p->i_rated_ma, MTPA_ONE_Q20, p->i_range_ma), 0, 2 * MTPA_ONE_Q20);
}

/* The q component of the least current for rated torque, 1 at least. */
static int32_t rated_i_q_q15(const struct params *p)
{
    const struct mtpa_machine m = mtpa_machine(p);
    return scale_clamp(mtpa_point(&m, rated_i_q20(p)).i_q_q20 >> 5, 1, INT16_MAX);
}

/*
 * Pole of the tracking loop. A load step of rated torque accelerates the rotor with A, and a double pole at a lags by A / a^2.
 * It is placed where that is 1.25 degrees: a faster one only passes more sensor noise to the speed loop. LAG converts rpm Q16 a
 * millisecond times pole pairs to Hz^2 in Q8: 256e3 / (65536 60 2 pi 1.25 (2 pi / 360)).
 */
#define INJECTION_POLE_MAX_HZ 60
#define INJECTION_LAG_E6      475032

static int32_t track_of(const struct tuning *t, int32_t pole_hz_q4)
{
    return (int32_t)scale(2 * pole_hz_q4, 1 << 13, t->loop_hz);
}

/* In the tuning's torque unit. */
static int64_t rated_torque_q15(const struct params *p)
{
    const struct mtpa_machine m = mtpa_machine(p);
    const int32_t i_q20 = rated_i_q20(p);
    return m.saliency != 0 ? scale(mtpa_point(&m, i_q20).torque, 32768, mtpa_point(&m, MTPA_ONE_Q20).torque)
                           : i_q20 >> 5;
}

static int32_t injection_pole_hz_q4(const struct params *p, const struct tuning *t)
{
    const int64_t slope_q16 = (rated_torque_q15(p) << 24) / q15_max(t->speed_accel_q8, 1);
    const int64_t squared_q8 = scale(slope_q16 * p->pole_pairs, INJECTION_LAG_E6, 1000000);
    const int64_t limit_q8 = 256 * INJECTION_POLE_MAX_HZ * INJECTION_POLE_MAX_HZ;
    return polar_root_down((uint32_t)(squared_q8 < limit_q8 ? squared_q8 : limit_q8));
}

/* From a quarter of rated current on, cross saturation is as at rated current. */
#define CROSS_FROM_PART 4

static void tune_injection(const struct params *p, struct tuning *t)
{
    t->injection.v_q15 = scale_clamp(scale(p->injection_mv, 32768, p->v_range_mv), 0, INT16_MAX);
    t->injection.turned = t->delay_halves == 1 ? -1 : 0;
    t->injection.silent = p->injection_silent;
    t->injection.track_most = track_of(t, 16 * INJECTION_POLE_MAX_HZ);
    t->injection.track = track_of(t, injection_pole_hz_q4(p, t));
    t->injection.polarity_q15 = tuning_q15_from_milli(p->i_align_ma, p->i_range_ma);
    t->injection.cross_q15 = p->cross_pm * 32768 / 1000;
    t->injection.cross_from_q15 = t->observer.iron_q15 / CROSS_FROM_PART + 1;
}

enum error tuning_observer(const struct params *p, struct tuning *t)
{
    const int64_t ld_nwb = (int64_t)mtpa_ld_uh(p) * p->i_range_ma;
    const int64_t lq_nwb = (int64_t)mtpa_lq_uh(p) * p->i_range_ma;
    const int64_t magnet_nwb = p->flux_uwb * 1000LL;
    const int64_t rest_nwb = p->lq_rest_uh > mtpa_lq_uh(p) ? (int64_t)p->lq_rest_uh * p->i_range_ma : lq_nwb;
    const int64_t unit_nwb = magnet_nwb + (ld_nwb > rest_nwb ? ld_nwb : rest_nwb);
    /* mV over nWb are 1e6, and 36 = 28 of the flux + 8 */
    const int64_t of_bus = scale(p->v_range_mv * 1000000LL, 1LL << 36, (int64_t)CONFIG_BUS_STEPS * t->loop_hz);
    /* mohm and mA over nWb are 1e3; 18 = 28 of the flux + 5 - 15 of the current */
    const int64_t r_q5 = scale((int64_t)p->resistance_mohm * p->i_range_ma * 1000, 1 << 18, t->loop_hz * unit_nwb);
    t->observer.magnet = (int32_t)scale(magnet_nwb, 1 << 14, unit_nwb);
    t->observer.ld = (int32_t)scale(ld_nwb, 1 << 14, unit_nwb);
    t->observer.lq = (int32_t)scale(lq_nwb, 1 << 14, unit_nwb);
    t->observer.lq_more = (int32_t)scale(rest_nwb - lq_nwb, 1 << 14, unit_nwb);
    t->observer.iron_q15 = rated_i_q_q15(p);
    t->observer.of_bus_q8 = scale_clamp(scale(of_bus, 1, unit_nwb), 0, INT32_MAX);
    t->observer.r_q5 = scale_clamp(r_q5, 0, R_MAX_Q5);
    t->observer.usable = t->observer.magnet >= 1 && r_q5 <= R_MAX_Q5;
    t->angle_source = (uint32_t)p->angle_source;
    tune_field(p, t);
    tune_injection(p, t);
    if (t->reluctant && p->injection_mv == 0) {
        return ERROR_SENSORLESS_RELUCTANT;
    }
    if (t->delay_halves == 2 && p->injection_mv != 0) {
        return ERROR_INJECTION_UPDATE;
    }
    return t->observer.usable ? ERROR_NONE : ERROR_OBSERVER;
}

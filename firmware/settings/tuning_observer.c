/* SPDX-License-Identifier: MIT */
/*
 * The machine model of the flux observer (control/observer.h). Its unit of flux, 2^28, is the sum of the magnets' flux and that
 * of i_range through the larger inductance. Inductances are flux over current: the apparent ones in saturated iron.
 */
#include "firmware/settings/config.h"
#include "firmware/settings/mtpa.h"
#include "firmware/settings/scale.h"
#include "firmware/settings/tuning_parts.h"
#include "lib/polar.h"
#include "lib/q15.h"

#define R_MOST_Q5 32767 /* times a current of 65534 */

/*
 * The ramp may take 15 % of the largest current, leaving the rest for a load: rated load and this ramp together turn the rotor
 * about 55 degrees out of the field if i_max is 1.5 times rated.
 */
#define RAMP_PERCENT  15
#define ALIGN_PERIODS 5
#define ALIGN_LEAST   300 /* ms */
#define ALIGN_MOST    2000

static void tune_field(const struct params *p, struct tuning *t)
{
    const int64_t slope_q16 = ((int64_t)t->i_max_q15 << 24) * RAMP_PERCENT / 100 / q15_max(t->speed_accel_q8, 1);
    const int32_t align_ms = ALIGN_PERIODS * t->align[0].period_ms;
    t->field.i_align_q15 = t->align[0].i_q15;
    t->field.align_ms = q15_clamp(align_ms, ALIGN_LEAST, ALIGN_MOST);
    t->field.i_q15 = t->i_max_q15;
    t->field.ramp_q16 = scale_clamp(slope_q16, 1, t->ramp_q16);
    /* 2 zeta w: 0.7 2 pi a period; that of i_align; the field's own is slightly less */
    t->field.rest_ms = q15_max(t->align[0].period_ms, 1);
    t->field.yield_loops = scale_clamp((int64_t)t->field.rest_ms * t->loops_per_slow * 10 / 44 + 1, 1, INT32_MAX);
    /* a field of up to 0.86 w catches a rotor at rest; it reaches 0.4 w in 0.3 of a turn, whichever way the rotor sticks */
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
#define INJECTION_POLE_MOST_HZ 60
#define INJECTION_LAG_E6       475032

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
    const int64_t most_q8 = 256 * INJECTION_POLE_MOST_HZ * INJECTION_POLE_MOST_HZ;
    return polar_root_down((uint32_t)(squared_q8 < most_q8 ? squared_q8 : most_q8));
}

/* From a quarter of rated current on, cross saturation is as at rated current. */
#define CROSS_FROM_PART 4

static void tune_injection(const struct params *p, struct tuning *t)
{
    t->injection.v_q15 = scale_clamp(scale(p->injection_mv, 32768, p->v_range_mv), 0, INT16_MAX);
    t->injection.turned = t->delay_halves == 1 ? -1 : 0;
    t->injection.silent = p->injection_silent;
    t->injection.track_most = track_of(t, 16 * INJECTION_POLE_MOST_HZ);
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
    t->observer.r_q5 = scale_clamp(r_q5, 0, R_MOST_Q5);
    t->observer.usable = t->observer.magnet >= 1 && r_q5 <= R_MOST_Q5;
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

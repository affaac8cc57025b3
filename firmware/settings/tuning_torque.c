/* SPDX-License-Identifier: MIT */
/* Inputs of the torque limits: largest flux, bus energy, power that may be burnt in the windings. */
#include "firmware/settings/config.h"
#include "firmware/settings/mtpa.h"
#include "firmware/settings/scale.h"
#include "firmware/settings/tuning_parts.h"
#include "lib/q15.h"

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

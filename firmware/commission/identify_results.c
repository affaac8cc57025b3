/* SPDX-License-Identifier: MIT */
/* What identify knows and refuses, and what becomes a parameter of it. */
#include <stddef.h>

#include "firmware/commission/identify_parts.h"
#include "lib/q15.h"

#define CROSS_MOST_PM 249 /* as cross_pm takes it */

void identify_know(struct identify *d, enum identify_quantity what, int64_t value, int64_t interval)
{
    d->results[what] = (struct identify_result){
        .state = IDENTIFY_KNOWN, .value = (int32_t)value, .interval = (int32_t)(interval < 1 ? 1 : interval)};
}

void identify_know_exactly(struct identify *d, enum identify_quantity what, int32_t value)
{
    d->results[what] = (struct identify_result){.state = IDENTIFY_KNOWN, .value = value};
}

void identify_refuse(struct identify *d, enum identify_quantity from, enum identify_quantity to,
                     enum identify_reason reason)
{
    for (size_t what = from; what <= to; what++) {
        d->results[what] = (struct identify_result){.state = IDENTIFY_REFUSED, .reason = reason};
    }
}

void identify_refuse_rest(struct identify *d, enum identify_reason reason)
{
    for (size_t what = 0; what < IDENTIFY_QUANTITIES; what++) {
        if (d->results[what].state == IDENTIFY_UNKNOWN) {
            identify_refuse(d, (enum identify_quantity)what, (enum identify_quantity)what, reason);
        }
    }
}

/* ---- use: each returns how many parameters changed ---- */

static uint32_t results_put(int32_t *param, int64_t value)
{
    const uint32_t changed = *param != value ? 1u : 0u;
    *param = (int32_t)value;
    return changed;
}

static bool is_known(const struct identify *d, enum identify_quantity what)
{
    return d->results[what].state == IDENTIFY_KNOWN;
}

static uint32_t results_take(const struct identify *d, enum identify_quantity what, int32_t *param, int32_t units)
{
    return is_known(d, what) ? results_put(param, q15_max((d->results[what].value + units / 2) / units, 1)) : 0u;
}

/* Flux by current is an inductance: 0.1 uWb by mA are 1e2 uH. */
static int64_t apparent_uh(int64_t flux_e1_uwb, int64_t i_ma)
{
    const int64_t uh = flux_e1_uwb > 0 && i_ma > 0 ? scale(flux_e1_uwb, 100, i_ma) : 1;
    return uh < 1 ? 1 : uh;
}

/* Of current in d the part that it takes from the magnets' flux, or adds to it; calculated with that which is used. */
static uint32_t use_torque(const struct identify *d, struct params *p)
{
    if (!is_known(d, IDENTIFY_TORQUE_ACROSS) || !is_known(d, IDENTIFY_TORQUE_FLUX) || !is_known(d, IDENTIFY_FLUX)) {
        return 0;
    }
    const struct identify_result *const r = d->results;
    const int64_t i_d_ma = r[IDENTIFY_TORQUE_ID].value, sign = i_d_ma < 0 ? -1 : 1;
    const int64_t more_e1_uwb = (int64_t)r[IDENTIFY_TORQUE_FLUX].value - r[IDENTIFY_FLUX].value;
    return results_put(&p->ld_apparent_uh, apparent_uh(sign * more_e1_uwb, sign * i_d_ma)) +
           results_put(&p->lq_apparent_uh, apparent_uh(r[IDENTIFY_TORQUE_ACROSS].value, r[IDENTIFY_TORQUE_IQ].value)) +
           results_put(&p->cross_pm, q15_clamp(r[IDENTIFY_CROSS].value, -CROSS_MOST_PM, CROSS_MOST_PM));
}

/* Where reluctance outweighs the magnets the loops go by what the rated current leaves, and by that without one. */
static uint32_t use_inductances(const struct identify *d, struct params *p)
{
    if (!d->reluctant || !is_known(d, IDENTIFY_LD_Q3) || !is_known(d, IDENTIFY_LQ_Q3)) {
        return results_take(d, IDENTIFY_LD, &p->ld_uh, 1000) + results_take(d, IDENTIFY_LQ, &p->lq_uh, 1000);
    }
    return results_take(d, IDENTIFY_LD_Q3, &p->ld_uh, 1000) + results_take(d, IDENTIFY_LQ_Q3, &p->lq_uh, 1000) +
           results_take(d, IDENTIFY_LQ, &p->lq_rest_uh, 1000);
}

uint32_t identify_use(const struct identify *d, struct params *p)
{
    return use_inductances(d, p) + use_torque(d, p) + results_take(d, IDENTIFY_RESISTANCE, &p->resistance_mohm, 1000) +
           results_take(d, IDENTIFY_POLE_PAIRS, &p->pole_pairs, 1) +
           results_take(d, IDENTIFY_COUNTS, &p->encoder_counts, 1) + results_take(d, IDENTIFY_FLUX, &p->flux_uwb, 10) +
           results_take(d, IDENTIFY_INERTIA, &p->inertia_gmm2, 1) +
           results_take(d, IDENTIFY_COULOMB, &p->friction_unm, 1);
}

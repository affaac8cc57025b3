/* SPDX-License-Identifier: MIT */
/* From sums of samples to physical units. Thread: each division is 128 bits wide. */
#include "firmware/commission/identify_parts.h"
#include "firmware/settings/config.h"

#define LEAST_SAMPLES 8

int64_t identify_nv(const struct identify *d, int64_t v_sum_q15, int64_t count)
{
    return identify_scaled(v_sum_q15, d->params.v_range_mv * 1000000LL, count * 32768);
}

int64_t identify_ua(const struct identify *d, int64_t i_sum_q15, int64_t count)
{
    return identify_scaled(i_sum_q15, d->params.i_range_ma * 1000LL, count * 32768);
}

/* Volts are steps by BUS_STEPS of the bus. */
int64_t identify_wave_uv(const struct identify *d, const struct burst_sums *s)
{
    const int64_t vbus_q15 = scale(s->vbus_q15, 1, s->bursts);
    return scale(vbus_q15 * d->burst.v_steps, d->params.v_range_mv * 1000LL, 32768LL * CONFIG_BUS_STEPS);
}

int64_t identify_change_na(const struct identify *d, int64_t change_256ths)
{
    return scale(change_256ths, d->params.i_range_ma * 1000000LL, 256LL * 32768);
}

/* 1 rpm is 2 pi / 60 rad/s. */
int64_t identify_mrad_s(int64_t rpm_q15_sum, int64_t count)
{
    return identify_scaled(rpm_q15_sum, TWO_PI_E9, count * 32768LL * 60 * 1000000);
}

/* T = 1.5 p psi i: tenths of uWb times uA are 1e-13 Nm. */
int64_t identify_torque_nnm(const struct identify *d, int64_t flux_e1_uwb, int64_t i_ua)
{
    return identify_scaled(i_ua, 3LL * d->params.pole_pairs * flux_e1_uwb, 20000);
}

/* Least squares over t = 0, 1, ... n - 1, a millisecond each: (sum t x - mean t sum x) / (n (n^2 - 1) / 12). */
int64_t identify_slope_mrad_s2(const struct measure_run *r)
{
    const int64_t n = r->count;
    if (n < LEAST_SAMPLES) {
        return 0;
    }
    const int64_t above_q9 = 2 * r->tx - (n - 1) * r->x;
    const int64_t slope_q24 = identify_scaled(above_q9, 6LL << 15, n * (n * n - 1)); /* rpm per millisecond */
    return identify_scaled(slope_q24, TWO_PI_E9 * CONFIG_SLOW_HZ, 60000000LL << 24);
}

/* Regression with a separate intercept per run: resistance and dead time do not change while one current flows. */
int64_t identify_flux_of_runs(const struct identify *d, const struct measure_run *const runs[], int32_t count)
{
    int64_t xv_q12 = 0, xx = 0;
    for (int32_t k = 0; k < count; k++) {
        const struct measure_run *const r = runs[k];
        if (r->count >= LEAST_SAMPLES) {
            xv_q12 += (r->xv - identify_scaled(r->x, r->v, r->count)) * 4096;
            xx += r->xx - identify_scaled(r->x, r->x, r->count);
        }
    }
    if (xx <= 0 || xv_q12 <= 0) {
        return 0;
    }
    const int64_t slope_q34 = identify_scaled(xv_q12, 1 << 22, xx); /* Q15 by rpm Q9, 28 more bits: */
    const int64_t nv_per_rpm = identify_scaled(slope_q34, d->params.v_range_mv * 1000000LL, 1LL << 40);
    return identify_scaled(nv_per_rpm, 60 * 10000000LL, TWO_PI_E9 * d->params.pole_pairs);
}

int64_t identify_inertia_gmm2(const struct identify *d, int64_t flux_e1_uwb, const struct measure_run *a,
                              const struct measure_run *b)
{
    const int64_t apart_mrad_s2 = identify_slope_mrad_s2(a) - identify_slope_mrad_s2(b);
    if (apart_mrad_s2 == 0 || a->count == 0 || b->count == 0) {
        return 0;
    }
    const int64_t apart_ua = identify_ua(d, a->i, a->count) - identify_ua(d, b->i, b->count);
    const int64_t torque_nnm = identify_torque_nnm(d, flux_e1_uwb, apart_ua);
    return identify_scaled(apart_mrad_s2 < 0 ? -torque_nnm : torque_nnm, 1000, identify_size(apart_mrad_s2));
}

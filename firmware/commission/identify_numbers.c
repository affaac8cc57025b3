/* SPDX-License-Identifier: MIT */
/* Arithmetic for the thread's part of identify, and from sums of samples to physical units. Each division is 128 bits wide. */
#include "firmware/commission/identify_parts.h"
#include "firmware/settings/config.h"

#define ONE_Q30       (1LL << 30)
#define LEAST_SAMPLES 6

int32_t identify_within(int64_t value, int64_t most)
{
    return (int32_t)(value < 1 ? 1 : value < most ? value : most);
}

int64_t identify_scaled(int64_t a, int64_t b, int64_t c)
{
    const int64_t size = scale(identify_size(a), identify_size(b), c);
    return (a < 0) != (b < 0) ? -size : size;
}

int64_t identify_root(int64_t n)
{
    uint64_t root = 0;
    for (uint64_t bit = 1ULL << 31; bit != 0u; bit >>= 1) {
        const uint64_t next = root + bit;
        if (next * next <= (uint64_t)n) { /* next is below 2^32 */
            root = next;
        }
    }
    return (int64_t)root;
}

int64_t identify_interval(int64_t s, int64_t a, int64_t b)
{
    const int64_t sum = scale(identify_size(a), identify_size(a), 3) + scale(identify_size(b), identify_size(b), 3);
    return 2 * identify_root(scale(identify_size(s), identify_size(s), 1) + sum);
}

/* Student's t, two-sided 95 %, by degrees of freedom from 1 on, halved: in 256ths. */
static const uint16_t students_q8[] = {1626, 551, 407, 355, 329, 313, 303, 295, 290, 285, 282, 279, 277, 275, 273};

struct identify_spread identify_spread(const int64_t of[], int32_t count)
{
    int64_t sum = 0, squares = 0;
    for (int32_t k = 0; k < count; k++) {
        sum += of[k];
    }
    const int64_t mean = identify_scaled(sum, 1, count);
    for (int32_t k = 0; k < count; k++) {
        squares += (of[k] - mean) * (of[k] - mean);
    }
    const int64_t deviation = identify_root(scale(squares, 1, count * (count - 1)));
    return (struct identify_spread){mean, identify_scaled(deviation, students_q8[count - 2], 256)};
}

int64_t identify_log_q30(int64_t y_q30)
{
    const int64_t z_q30 = scale(y_q30, ONE_Q30, 2 * ONE_Q30 - y_q30);
    const int64_t square_q30 = (z_q30 * z_q30) >> 30;
    int64_t power_q30 = z_q30;
    int64_t sum_q30 = 0;
    for (int64_t n = 1; n < 1024 && power_q30 != 0; n += 2) {
        sum_q30 += scale(power_q30, 1, n);
        power_q30 = (power_q30 * square_q30) >> 30;
    }
    return 2 * sum_q30;
}

/* ---- units ---- */

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

/* A swing of height A during a run shifts its slope by up to 4 A over what the speed has grown by; A is rms times sqrt(2). */
#define BENDS_E3 5657

int64_t identify_bent_permille(const struct measure_run *r)
{
    const int64_t n = r->count;
    const int64_t above_q9 = identify_size(2 * r->tx - (n - 1) * r->x);
    const int64_t grown_q9 = scale(above_q9, 6, n * (n + 1));
    if (n < LEAST_SAMPLES || grown_q9 == 0) {
        return 1000;
    }
    const int64_t straight_q18 = scale(above_q9, grown_q9, 2 * (n - 1));
    const int64_t rest_q18 = r->xx - identify_scaled(r->x, r->x, n) - straight_q18;
    return scale(identify_root(rest_q18 < 0 ? 0 : rest_q18 / n), BENDS_E3, grown_q9);
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
    if (apart_mrad_s2 == 0 || a->count < LEAST_SAMPLES || b->count < LEAST_SAMPLES) {
        return 0;
    }
    const int64_t apart_ua = identify_ua(d, a->i, a->count) - identify_ua(d, b->i, b->count);
    const int64_t torque_nnm = identify_torque_nnm(d, flux_e1_uwb, apart_ua);
    return identify_scaled(apart_mrad_s2 < 0 ? -torque_nnm : torque_nnm, 1000, identify_size(apart_mrad_s2));
}

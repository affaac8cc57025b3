/* SPDX-License-Identifier: MIT */
/*
 * Arithmetic for identify's evaluation, and conversion from sums of samples to physical units. Each division is 128 bits wide.
 */
#include <stddef.h>

#include "firmware/commission/identify_parts.h"
#include "firmware/settings/config.h"
#include "lib/q15.h"

#define ONE_Q30     (1LL << 30)
#define MIN_SAMPLES 6

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
    if (n < MIN_SAMPLES) {
        return 0;
    }
    const int64_t above_q9 = 2 * r->tx - (n - 1) * r->x;
    const int64_t slope_q24 = identify_scaled(above_q9, 6LL << 15, n * (n * n - 1)); /* rpm per millisecond */
    return identify_scaled(slope_q24, TWO_PI_E9 * CONFIG_SLOW_HZ, 60000000LL << 24);
}

/*
 * An oscillation of amplitude A during a run shifts its slope by up to 4 A over the increase of speed; A is rms times sqrt(2).
 */
#define BENDS_E3 5657

int64_t identify_bent_permille(const struct measure_run *r)
{
    const int64_t n = r->count;
    const int64_t above_q9 = identify_size(2 * r->tx - (n - 1) * r->x);
    const int64_t grown_q9 = scale(above_q9, 6, n * (n + 1));
    if (n < MIN_SAMPLES || grown_q9 == 0) {
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
        if (r->count >= MIN_SAMPLES) {
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
    if (apart_mrad_s2 == 0 || a->count < MIN_SAMPLES || b->count < MIN_SAMPLES) {
        return 0;
    }
    const int64_t apart_ua = identify_ua(d, a->i, a->count) - identify_ua(d, b->i, b->count);
    const int64_t torque_nnm = identify_torque_nnm(d, flux_e1_uwb, apart_ua);
    return identify_scaled(apart_mrad_s2 < 0 ? -torque_nnm : torque_nnm, 1000, identify_size(apart_mrad_s2));
}

/* ==== results ==== */

/* Results, refusals, and their conversion to parameters. */

#define CROSS_MAX_PM 249 /* as cross_pm takes it */

void identify_set(struct identify *d, enum identify_quantity what, int64_t value, int64_t interval)
{
    d->results[what] = (struct identify_result){
        .state = IDENTIFY_KNOWN, .value = (int32_t)value, .interval = (int32_t)(interval < 1 ? 1 : interval)};
}

void identify_set_exact(struct identify *d, enum identify_quantity what, int32_t value)
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

/* Change of the magnets' flux by d current, relative to the flux that is used. */
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
           results_put(&p->cross_pm, q15_clamp(r[IDENTIFY_CROSS].value, -CROSS_MAX_PM, CROSS_MAX_PM));
}

/* If reluctance outweighs the magnets, the inductances are those at rated current and at zero current. */
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

/* ==== tuning of the next step ==== */

/* The tuning for a measurement, from what is known of the motor so far. */

/* Placeholders with which the speed loop's numbers fit their formats for any inverter; not used for control. */
#define FLUX_HZ          400 /* at which the bus voltage would be induced */
#define INERTIA_PART     700 /* gmm2 by uWb times mA */
#define INERTIA_MAX      2100000000
#define INDUCTANCE_PARTS 63 /* tuning.h: w_base L below 64 v_range / i_range */
#define RELUCTANT_PARTS  15 /* the large inductance at zero current is several times smaller with current */

/* While the rotor turns. */
#define TURNING_HZ       300
#define TURNING_SPEED_HZ 10

/* Ignores limits of the speed loop, which is not used at standstill and little while turning. */
static bool compute(struct identify *d, int32_t hz, struct tuning *t)
{
    struct params *const p = &d->params;
    const int64_t parts = d->reluctant ? RELUCTANT_PARTS : INDUCTANCE_PARTS;
    const int64_t largest_uh = scale(p->v_range_mv, parts * 1000000LL, 7854LL * p->i_range_ma);
    p->current_bw_hz = hz;
    p->ld_uh = identify_within(p->ld_uh, largest_uh);
    p->lq_uh = identify_within(p->lq_uh, largest_uh);
    const struct outcome outcome = tuning_compute(p, t);
    return outcome.error == ERROR_NONE || outcome.error == ERROR_SPEED_RESOLUTION ||
           outcome.error == ERROR_SPEED_UNRESOLVED || outcome.error == ERROR_SPEED_MARGIN ||
           outcome.error == ERROR_CURRENT_TOO_SLOW || outcome.error == ERROR_ENCODER_COARSE;
}

enum identify_reason identify_tune(struct identify *d, int32_t hz)
{
    struct tuning t;
    if (!compute(d, hz, &t)) {
        return IDENTIFY_STOPPED;
    }
    t.kp_q_q12 = 0;   /* see damp_q() */
    t.ripple_q10 = 0; /* the steps set dead-time compensation themselves */
    d->tuning = t;
    return IDENTIFY_NO_REASON;
}

enum identify_reason identify_tune_turning(struct identify *d, enum identify_reason otherwise)
{
    struct tuning t;
    d->params.speed_bw_hz = TURNING_SPEED_HZ;
    if (!compute(d, TURNING_HZ, &t)) {
        return otherwise;
    }
    t.emf_q12 = d->flux_e1_uwb == 0 ? 0 : t.emf_q12; /* not known yet */
    d->tuning = t;
    d->retuned = true;
    return IDENTIFY_NO_REASON;
}

void identify_replace(struct identify *d)
{
    d->ripple_q10 = d->tuning.ripple_q10;
    d->retuned = true;
}

void identify_reset_motor(struct params *p)
{
    const int64_t trip_ma = p->i_trip_ma * 85LL / 100;
    p->pole_pairs = 1;
    p->encoder_counts = (int32_t)ENCODER_COUNTS_MAX; /* any value: it is only counted */
    p->angle_source = PARAM_ANGLE_ENCODER;           /* with a prescribed field; the encoder is not used */
    p->resistance_mohm = identify_within(scale(p->v_range_mv, 20, p->i_range_ma), 100000);
    p->ld_uh = p->lq_uh = identify_within(scale(p->v_range_mv, 10, p->i_range_ma), 1000000);
    p->ld_apparent_uh = p->lq_apparent_uh = p->lq_rest_uh = p->cross_pm = 0;
    p->flux_uwb = (int32_t)scale(p->v_range_mv, 1000000, 6283LL * FLUX_HZ); /* 0.8 Wb at most */
    p->inertia_gmm2 = identify_within(scale(p->flux_uwb, p->i_range_ma, INERTIA_PART), INERTIA_MAX);
    p->i_max_ma = identify_within(p->i_rated_ma, trip_ma);
    p->i_align_ma = p->i_max_ma;
    p->pwm_update = PWM_UPDATE_VALLEY;
    p->pwm_samples = 1;
    p->speed_bw_hz = 1;
    p->position_bw_hz = 0;
    p->torque_mean_ms = 1;
}

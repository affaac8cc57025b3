/* SPDX-License-Identifier: MIT */
#include "firmware/commission/wiring.h"

#include <stddef.h>

#include "firmware/commission/measure.h"
#include "firmware/settings/config.h"

/* ==== the sensors' zeros ==== */

#define SAMPLES_LOG2 7
#define SAMPLES      CALIBRATION_MS

_Static_assert(SAMPLES == 1 << SAMPLES_LOG2, "a mean is a shift");
#define NOMINAL ((int32_t)BOARD_ADC_OFFSET_NOMINAL)
#define ALLOWED (102 * BOARD_ADC_Q15_PER_CODE) /* 5 % of 2048 codes */

void calibration_start(struct calibration *k)
{
    k->count = 0;
    k->sum_q15[0] = 0;
    k->sum_q15[1] = 0;
    k->sum_q15[2] = 0;
}

/* Rounded to nearest; a division would round towards zero. */
static int32_t mean_q15(int32_t of_sum_q15)
{
    return (of_sum_q15 + SAMPLES / 2) >> SAMPLES_LOG2;
}

/* The present offsets are subtracted already: the mean is their error. */
static enum calibration_result calibration_finish(const struct calibration *k, struct adc_regs *adc)
{
    uint32_t offset_q15[3];
    adc_offsets(adc, offset_q15);
    for (unsigned i = 0; i < 3; i++) {
        const int32_t corrected = (int32_t)offset_q15[i] + mean_q15(k->sum_q15[i]);
        if (corrected < NOMINAL - ALLOWED || corrected > NOMINAL + ALLOWED) {
            return CALIBRATION_OUT_OF_RANGE;
        }
        offset_q15[i] = (uint32_t)corrected;
    }
    adc_set_offsets(adc, offset_q15);
    return CALIBRATION_DONE;
}

enum calibration_result calibration_step(struct calibration *k, struct adc_regs *adc)
{
    const struct adc_sample sample = adc_read(adc);
    k->sum_q15[0] += sample.ia_q15;
    k->sum_q15[1] += sample.ib_q15;
    k->sum_q15[2] += sample.ic_q15;
    k->count++;
    return k->count < SAMPLES ? CALIBRATION_RUNNING : calibration_finish(k, adc);
}

/* ==== the phases ==== */

#define THIRD_Q32   0x55555555u                  /* 120 degrees */
#define MAX_256THS  (CONFIG_BUS_STEPS / 5 * 256) /* a fifth of the bus */
#define RISE_MS     40u /* a quarter more each: from the first voltage to the maximum, and some time there */
#define FALL_MS     25u
#define REST_MS     100u /* four time constants of the slowest windings */
#define SHARE_TENTH 3
#define BLIND_PART  4
#define RIGHT_ORDER 123

const struct tuning wiring_tuning = {.v_min_q15 = Q15_ONE / 4};

void wiring_start(struct wiring *w, bool slow)
{
    *w = (struct wiring){.slow = slow};
}

static int32_t largest(const int32_t of_q15[3])
{
    return q15_max(q15_max(q15_abs(of_q15[0]), q15_abs(of_q15[1])), q15_abs(of_q15[2]));
}

static void wiring_keep(struct wiring *w, const int32_t i_q15[3])
{
    for (size_t k = 0; k < 3u; k++) {
        w->rise_q15[w->along][k] = i_q15[k];
    }
    w->v_256ths = 0;
    w->ms = 0;
}

/* The resistive voltage for a quarter of the current. */
static int32_t first_256ths(const struct tuning *t, const volatile struct current_loop *c)
{
    return q15_clamp(measure_steps(c, t->wiring_v_q15 / 4), 8, MAX_256THS / 256) * 256;
}

/* Subtracts the remaining current of the previous phase: with large inductance it decays slowly. */
static void begin(struct wiring *w, const int32_t i_q15[3], int32_t v_256ths)
{
    for (size_t k = 0; k < 3u; k++) {
        w->before_q15[k] = i_q15[k];
    }
    w->v_256ths = v_256ths;
    w->ms = 0;
}

static bool is_share(int32_t i_q15, int32_t max_q15)
{
    return q15_abs(i_q15) * 10 >= max_q15 * SHARE_TENTH;
}

/* Correlation of a sensor with a phase and against the other two, of either sign. */
static int32_t goes_with(const struct wiring *w, uint32_t sensor, uint32_t phase)
{
    const int32_t sum_q15 = w->rise_q15[0][sensor] + w->rise_q15[1][sensor] + w->rise_q15[2][sensor];
    return q15_abs(3 * w->rise_q15[phase][sensor] - sum_q15);
}

/*
 * The order in which the sensors show the phases, as digits: that of the largest correlation. With mean admittance m and half
 * the axes' difference s the right one has 3 m, one with two sensors exchanged 2 m + s at most, at any rotor angle.
 */
static int32_t order_shown(const struct wiring *w)
{
    static const uint8_t orders[][3] = {{1, 2, 3}, {2, 1, 3}, {1, 3, 2}, {3, 2, 1}, {2, 3, 1}, {3, 1, 2}};
    int32_t best = 0;
    int32_t most = -1;
    for (size_t n = 0; n < sizeof orders / sizeof orders[0]; n++) {
        const uint8_t *const o = orders[n];
        const int32_t fits = goes_with(w, 0, o[0] - 1u) + goes_with(w, 1, o[1] - 1u) + goes_with(w, 2, o[2] - 1u);
        if (fits > most) {
            most = fits;
            best = o[0] * 100 + o[1] * 10 + o[2];
        }
    }
    return best;
}

static enum wiring_result wiring_judge(struct wiring *w, const struct tuning *t)
{
    int32_t largest_q15[3];
    for (size_t k = 0; k < 3u; k++) {
        largest_q15[k] = largest((const int32_t[3]){w->rise_q15[0][k], w->rise_q15[1][k], w->rise_q15[2][k]});
    }
    const int32_t max_q15 = largest(largest_q15);
    if (max_q15 < t->wiring_i_q15 / 2) {
        return WIRING_OPEN;
    }
    for (size_t k = 0; k < 3u; k++) {
        w->phase = (int32_t)k + 1;
        if (w->blind[k] || !is_share(largest_q15[k], max_q15)) {
            return WIRING_OPEN;
        }
    }
    w->phase = order_shown(w);
    if (w->phase != RIGHT_ORDER) {
        return WIRING_EXCHANGED;
    }
    for (size_t k = 0; k < 3u; k++) {
        w->phase = (int32_t)k + 1;
        if (w->rise_q15[k][k] < 0) {
            /* lost since the others were tested */
            return is_share(w->rise_q15[k][k], max_q15) ? WIRING_SIGN : WIRING_OPEN;
        }
    }
    return WIRING_GOOD;
}

/* The larger of a phase's currents in both samples, or the only one. Blind if the other is less than a quarter of it. */
static void wiring_look(struct wiring *w, const struct tuning *t, const struct adc_regs *adc, int32_t i_q15[3])
{
    const struct adc_sample s = adc_read(adc);
    const struct adc_sample next = t->samples == 2 ? adc_read_next(adc, (uint32_t)t->loop_counts) : s;
    const int32_t first_q15[3] = {s.ia_q15, s.ib_q15, s.ic_q15};
    const int32_t second_q15[3] = {next.ia_q15, next.ib_q15, next.ic_q15};
    for (size_t k = 0; k < 3u; k++) {
        const bool more = q15_abs(second_q15[k]) > q15_abs(first_q15[k]);
        const int32_t less_q15 = more ? first_q15[k] : second_q15[k];
        i_q15[k] = more ? second_q15[k] : first_q15[k];
        w->blind[k] = w->blind[k] ||
                      (q15_abs(i_q15[k]) >= t->wiring_i_q15 / 4 && q15_abs(less_q15) < q15_abs(i_q15[k]) / BLIND_PART);
    }
}

enum wiring_result wiring_step(struct wiring *w, volatile struct current_loop *c, const struct tuning *t,
                               const struct adc_regs *adc)
{
    int32_t i_q15[3];
    wiring_look(w, t, adc, i_q15);
    const int32_t rise_q15[3] = {i_q15[0] - w->before_q15[0], i_q15[1] - w->before_q15[1], i_q15[2] - w->before_q15[2]};
    w->ms++;
    const bool rests = w->slow ? w->ms > REST_MS : w->ms > FALL_MS || largest(i_q15) < t->wiring_i_q15 / 4;
    if (w->v_256ths == 0 && rests) {
        if (w->along == 3u) {
            return wiring_judge(w, t);
        }
        begin(w, i_q15, first_256ths(t, c));
    } else if (w->v_256ths != 0 && (largest(rise_q15) >= t->wiring_i_q15 || w->ms > RISE_MS)) {
        wiring_keep(w, rise_q15);
        w->along++;
    } else {
        w->v_256ths = q15_min(w->v_256ths + w->v_256ths / 4, MAX_256THS);
    }
    measure_hold_voltage(c, w->along * THIRD_Q32, w->v_256ths >> 8, 0);
    return WIRING_RUNNING;
}

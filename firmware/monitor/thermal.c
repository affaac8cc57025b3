/* SPDX-License-Identifier: MIT */
#include "firmware/monitor/thermal.h"

#include <stddef.h>

#include "drivers/fabric/adc.h"
#include "lib/q15.h"

#define WINDING_SAMPLE    1u /* the work of an update, spread over samples */
#define INVERTER_SAMPLE   2u
#define AMBIENT_C         40
#define AMBIENT_Q4        (AMBIENT_C * 16)
#define COPPER_ZERO_C     235 /* copper: linear extrapolation of the resistance is zero at -235 degC */
#define DERATE_Q4         (10 * 16)
#define LOSS_MAX_Q10      (20 << 10) /* times the rated loss: the range of the calculation */
#define TOP_Q20           ((1 << 20) + (1 << 20) / 20)
#define INVERTER_BAND_Q15 (Q15_ONE / 10)
#define SENSOR_MIN_CODE   16u /* closer to an end of the range is not a valid temperature */
#define SENSOR_MAX_CODE   4079u
#define SENSOR_FAR_Q4     (80 * 16) /* from a model at 40 degC ambient to -40 degC */
#define SENSOR_UPDATES    20u       /* two seconds */

/* Fraction of the step response per update, for this time constant; 1 at most. */
static int32_t rate_q31(int32_t tau_ms)
{
    const int64_t rate = ((int64_t)THERMAL_PERIOD_MS << 31) / tau_ms;
    return rate > INT32_MAX ? INT32_MAX : (int32_t)rate;
}

static int32_t q10(int32_t milliamp, int32_t range_ma)
{
    const int64_t value = ((int64_t)milliamp * 1024 + range_ma / 2) / range_ma;
    return value > INT16_MAX ? INT16_MAX : (int32_t)value;
}

void thermal_tune(struct thermal *th, const struct params *p)
{
    const int32_t rise_q4 = p->t_max_c * 16 - AMBIENT_Q4;
    th->winding_full_q4 = rise_q4 * p->winding_share_pct / 100;
    th->housing_full_q4 = rise_q4 - th->winding_full_q4;
    th->winding_rate_q31 = rate_q31(p->winding_tau_s * 1000);
    th->housing_rate_q31 = rate_q31(p->housing_tau_s * 1000);
    th->inverter_rate_q31 = rate_q31(p->inverter_tau_ms);
    th->max_q4 = p->t_max_c * 16;
    th->rated_q10 = q15_max(q10(p->i_rated_ma, p->i_range_ma), 1);
    th->inverter_q10 = p->inverter_ma == 0 ? 0 : q15_max(q10(p->inverter_ma, p->i_range_ma), 1);
}

static uint32_t thermal_checksum(const struct thermal_memory *m)
{
    return ~(m->mark + (uint32_t)m->winding_q20 + 3u * (uint32_t)m->housing_q20);
}

static void thermal_keep(struct thermal *th)
{
    if (th->memory != NULL) {
        *th->memory = (struct thermal_memory){THERMAL_MARK, th->winding_q20, th->housing_q20, 0};
        th->memory->check = thermal_checksum(th->memory);
    }
}

void thermal_init(struct thermal *th, struct thermal_memory *memory, const struct params *p)
{
    *th = (struct thermal){.memory = memory, .winding_q4 = AMBIENT_Q4, .factor_q15 = Q15_ONE};
    thermal_tune(th, p);
    if (memory != NULL && memory->mark == THERMAL_MARK && memory->check == thermal_checksum(memory)) {
        th->winding_q20 = memory->winding_q20;
        th->housing_q20 = memory->housing_q20;
    }
}

/* First-order lag; rounded to nearest, so that a long time constant does not stop short of the final value. */
static void thermal_follow(int32_t *x_q20, int32_t end_q20, int32_t rate)
{
    *x_q20 += (int32_t)((((int64_t)end_q20 - *x_q20) * rate + (1 << 30)) >> 31);
}

/* The current's mean square over that of `full_q10`, 1024 = equal. */
static int32_t loss_q10(uint32_t mean_q20, int32_t full_q10)
{
    const uint32_t full_q20 = (uint32_t)full_q10 * (uint32_t)full_q10;
    const uint32_t loss = mean_q20 > UINT32_MAX >> 10 ? UINT32_MAX / full_q20 : (mean_q20 << 10) / full_q20;
    return loss > LOSS_MAX_Q10 ? LOSS_MAX_Q10 : (int32_t)loss;
}

/* The final value of the rise: in K, Q20, at most 1000 K. */
static int32_t end_q20(int32_t full_q4, int32_t loss)
{
    return q15_min((full_q4 * loss) >> 4, 1000 << 10) * 1024;
}

static int32_t factor_q15(int32_t left, int32_t band)
{
    return q15_clamp(left, 0, band) * Q15_ONE / band;
}

static void update_winding(struct thermal *th)
{
    const int32_t model_q4 = AMBIENT_Q4 + ((th->winding_q20 + th->housing_q20) >> 16);
    const int32_t cold = loss_q10(th->mean_q20, th->rated_q10);
    const int32_t loss =
        q15_min(cold * (COPPER_ZERO_C * 16 + model_q4) / (COPPER_ZERO_C * 16 + th->max_q4), LOSS_MAX_Q10);
    thermal_follow(&th->winding_q20, end_q20(th->winding_full_q4, loss), th->winding_rate_q31);
    thermal_follow(&th->housing_q20, end_q20(th->housing_full_q4, loss), th->housing_rate_q31);
    thermal_keep(th);
}

static void update_inverter(struct thermal *th)
{
    if (th->inverter_q10 != 0) {
        thermal_follow(&th->inverter_q20, loss_q10(th->mean_q20, th->inverter_q10) << 10, th->inverter_rate_q31);
    }
}

static bool is_temperature(uint32_t sensor_code)
{
    return sensor_code >= SENSOR_MIN_CODE && sensor_code <= SENSOR_MAX_CODE;
}

/*
 * Cooler than the model by more than good cooling explains; or, beyond t_max, warmer than a failed fan and a hot start explain.
 */
static bool is_far_from_model(const struct thermal *th, int32_t sensed_q4, int32_t model_q4)
{
    const int32_t far_q4 = q15_max(SENSOR_FAR_Q4, (th->winding_full_q4 + th->housing_full_q4) * 2 / 3);
    return sensed_q4 < model_q4 - far_q4 || sensed_q4 > q15_max(model_q4 + far_q4, th->max_q4 + DERATE_Q4);
}

static void watch_sensor(struct thermal *th, uint32_t sensor_code, int32_t sensed_q4, int32_t model_q4)
{
    th->sensor_seen = th->sensor_seen || sensor_code != 0u;
    const bool is_implausible =
        th->sensor_seen && (!is_temperature(sensor_code) || is_far_from_model(th, sensed_q4, model_q4));
    if (is_implausible && th->implausible < SENSOR_UPDATES) {
        th->implausible++;
    } else if (!is_implausible && th->implausible > 0u) {
        th->implausible--;
    }
    th->sensor_fails = th->implausible == SENSOR_UPDATES || (th->sensor_fails && th->implausible > 0u);
}

static void update_limit(struct thermal *th, uint32_t sensor_code)
{
    const int32_t model_q4 = AMBIENT_Q4 + ((th->winding_q20 + th->housing_q20) >> 16);
    const int32_t sensed_q4 = (int32_t)sensor_code - ADC_TEMP_CODE_AT_0_C;
    watch_sensor(th, sensor_code, sensed_q4, model_q4);
    th->winding_q4 = is_temperature(sensor_code) ? q15_max(model_q4, sensed_q4) : model_q4;
    th->factor_q15 = factor_q15(th->max_q4 - th->winding_q4, DERATE_Q4);
    if (th->inverter_q10 != 0) {
        th->factor_q15 = q15_min(th->factor_q15, factor_q15((TOP_Q20 - th->inverter_q20) >> 5, INVERTER_BAND_Q15));
    }
}

/* The last sample closes the mean; the samples after it do the update in parts. */
void thermal_update(struct thermal *th, uint32_t sensor_code)
{
    if (th->samples == THERMAL_SAMPLES) {
        th->mean_q20 = th->i_squared_q20 / THERMAL_SAMPLES;
        th->samples = 0;
        th->i_squared_q20 = 0;
    } else if (th->samples == WINDING_SAMPLE) {
        update_winding(th);
    } else if (th->samples == INVERTER_SAMPLE) {
        update_inverter(th);
    } else if (th->samples == THERMAL_LAST_UPDATE) {
        update_limit(th, sensor_code);
    }
}

void thermal_step(struct thermal *th, const volatile struct current_loop *c, uint32_t sensor_code)
{
    if (thermal_sample(th, c)) {
        thermal_update(th, sensor_code);
    }
}

/* SPDX-License-Identifier: MIT */
/*
 * Temperatures of winding and power stage, from the current that flowed: ten times a second, in integers.
 *
 * Winding: two bodies in Foster form, winding over housing and housing over air, each with a rise that follows the copper loss
 * with its own time constant; at i_rated both together reach t_max from 40 degC. The loss follows the winding's temperature
 * (copper: 1/(234.5 degC + T)). With a sensor, the warmer of model and sensor counts: the sensor lags a sudden overload, the
 * model does not see a blocked fan. Power stage: one body, I^2 t, settling at 1.0 at inverter_ma.
 *
 * An implausible sensor is reported (thermal_sensor_fails()): lost, at an end of its range, or so far from the model that
 * neither ambient temperature nor a power-off explains it. At an end of its range it is ignored.
 *
 * Over the last 10 K, or the last tenth, the current limit falls to zero. Beyond that is a fault.
 *
 * Heat survives a reset: the two rises are kept in RAM that a reset does not clear.
 */
#ifndef FIRMWARE_MONITOR_THERMAL_H
#define FIRMWARE_MONITOR_THERMAL_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/current_loop.h"
#include "firmware/settings/params.h"

#define THERMAL_PERIOD_MS 100
#define THERMAL_STEP_MS   4
#define THERMAL_MARK      0x7E3A1C05u

/* In RAM that a reset does not clear. */
struct thermal_memory {
    uint32_t mark;
    int32_t winding_q20, housing_q20;
    uint32_t check;
};

struct thermal {
    struct thermal_memory *memory; /* NULL: none */
    uint32_t samples;              /* since the last update */
    uint32_t i_squared_q20;        /* their sum */
    uint32_t mean_q20;             /* of the previous update */
    /* from the parameters, at `on` */
    int32_t rated_q10;                                             /* i_rated, 1024 = i_range */
    int32_t inverter_q10;                                          /* 0: not watched */
    int32_t winding_full_q4, housing_full_q4;                      /* rises at i_rated, 1/16 K */
    int32_t winding_rate_q31, housing_rate_q31, inverter_rate_q31; /* fraction of the step response per update */
    int32_t max_q4;                                                /* t_max, 1/16 degC */
    /* state */
    int32_t winding_q20, housing_q20; /* rises, K */
    int32_t inverter_q20;             /* 1.0 = steady state at inverter_ma */
    int32_t winding_q4;               /* effective temperature, 1/16 degC */
    int32_t factor_q15;               /* of the current limit, 0...1.0 */
    bool sensor_seen;                 /* one is fitted */
    bool sensor_fails;
    uint32_t implausible; /* updates with an implausible sensor, less those with a plausible one */
};

/* Restores what `memory` holds if it is valid, else starts cold. Thread, once; memory may be NULL. */
void thermal_init(struct thermal *th, struct thermal_memory *memory, const struct params *p);

/* Takes the parameters; temperatures stay. Thread, bridge off; 64-bit divisions. */
void thermal_tune(struct thermal *th, const struct params *p);

#define THERMAL_SAMPLES     (THERMAL_PERIOD_MS / THERMAL_STEP_MS)
#define THERMAL_LAST_UPDATE 3u /* samples after the mean's last: each of 1, 2 and 3 does a part of the update */

/* Samples the currents, every THERMAL_STEP_MS, in any state. True if thermal_update() must follow. Slow loop. */
static inline bool thermal_sample(struct thermal *th, const volatile struct current_loop *c)
{
    const int32_t d_q10 = c->i_d_q15 >> 5;
    const int32_t q_q10 = c->i_q_q15 >> 5;
    const uint32_t samples = th->samples + 1u;
    th->i_squared_q20 += (uint32_t)(d_q10 * d_q10 + q_q10 * q_q10);
    th->samples = samples;
    return samples <= THERMAL_LAST_UPDATE || samples == THERMAL_SAMPLES;
}

/* Updates the temperatures; `sensor_code` as adc_temperature_code(). Slow loop. */
void thermal_update(struct thermal *th, uint32_t sensor_code);

/* thermal_sample() and, if due, thermal_update(). Slow loop. */
void thermal_step(struct thermal *th, const volatile struct current_loop *c, uint32_t sensor_code);

/* The derated current limit. Any context. */
static inline int32_t thermal_i_limit_q15(const struct thermal *th, int32_t i_max_q15)
{
    return (i_max_q15 * th->factor_q15) >> 15;
}

/* The sensor has been implausible for two seconds. Any context. */
static inline bool thermal_sensor_fails(const struct thermal *th)
{
    return th->sensor_fails;
}

/* Above their limits. Any context. */
static inline bool thermal_winding_too_hot(const struct thermal *th)
{
    return th->winding_q4 > th->max_q4;
}

static inline bool thermal_inverter_too_hot(const struct thermal *th)
{
    return th->inverter_q20 > (1 << 20) + (1 << 20) / 20;
}

#endif

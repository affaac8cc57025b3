/* SPDX-License-Identifier: MIT */
#include "firmware/settings/margins.h"

#include "firmware/settings/config.h"
#include "firmware/settings/mtpa.h"
#include "firmware/settings/scale.h"
#include "lib/polar.h"
#include "lib/trig.h"

#define TURN_U16            65536
#define QUARTER_U16         (TURN_U16 / 4)
#define MARGIN_U16          (TURN_U16 * MARGIN_DEG / 360)
#define POSITION_MARGIN_U16 (TURN_U16 * MARGIN_POSITION_DEG / 360)
#define INTEGRAL_LAG_U16    2486 /* 13.654 degrees */
#define PI_Q15              102944LL
#define Q15_UNITY           32768
#define CROSSOVER_E4        10291 /* of the speed loop over its bandwidth */
#define SPEED_BW_STEP_HZ    512   /* first step of the bisections: below 1024 Hz, */
#define POSITION_BW_STEP_HZ 128   /* below the largest speed_bw_hz, */
#define X_MAX_Q12           8192  /* and below twice the speed loop's bandwidth: beyond any crossover */

/* Of the speed loop, in microseconds: see margins.h. */
#define SLOW_US  (1000000 / (int32_t)CONFIG_SLOW_HZ)
#define PWM_US   (1000000 / (int32_t)CONFIG_PWM_HZ)
#define DELAY_US (SLOW_US + PWM_US + SLOW_US / 8)

/* a / (2 pi) at the limit, in 1e-7: 2 sin(15), 2 tan(22.5), 2 sin(30 degrees). */
static const int32_t largest_e7[] = {
    [PWM_UPDATE_VALLEY] = 823846,
    [PWM_UPDATE_ENDS] = 1318483,
    [PWM_UPDATE_ONCE] = 1591549,
};

int32_t margin_current_bw_hz(enum pwm_update update, int32_t samples)
{
    return (int32_t)((int64_t)CONFIG_PWM_HZ * samples * largest_e7[delay_alike(update, samples)] / 10000000);
}

/* x / 2 is the angle whose sine, or tangent, is a / 2. */
int32_t margin_of_current_u16(int32_t current_bw_hz, enum pwm_update update, int32_t samples)
{
    const int32_t half_q15 = (int32_t)(current_bw_hz * PI_Q15 / (CONFIG_PWM_HZ * samples));
    const int32_t adjacent_q15 = delay_alike(update, samples) == PWM_UPDATE_ENDS
                                     ? Q15_UNITY
                                     : polar_root_down((uint32_t)(Q15_UNITY * Q15_UNITY - half_q15 * half_q15));
    return QUARTER_U16 - delay_halves(update, samples) * (int32_t)(atan2_q32(half_q15, adjacent_q15) >> 16);
}

static int32_t delay_us(int32_t torque_mean_ms)
{
    return DELAY_US + (torque_mean_ms - 1) * (SLOW_US / 2);
}

int32_t margin_of_speed_u16(int32_t speed_bw_hz, int32_t current_bw_hz, int32_t torque_mean_ms)
{
    const int32_t crossover_e4 = speed_bw_hz * CROSSOVER_E4;
    const int32_t current_lag = (int32_t)(atan2_q32(crossover_e4, current_bw_hz * 10000) >> 16);
    const int32_t delay = (int32_t)((int64_t)crossover_e4 * delay_us(torque_mean_ms) * TURN_U16 / 10000000000LL);
    return QUARTER_U16 - INTEGRAL_LAG_U16 - current_lag - delay;
}

int32_t margin_speed_bw_hz(int32_t current_bw_hz, int32_t torque_mean_ms)
{
    int32_t largest_hz = 0;
    for (int32_t step = SPEED_BW_STEP_HZ; step > 0; step /= 2) {
        largest_hz += margin_of_speed_u16(largest_hz + step, current_bw_hz, torque_mean_ms) >= MARGIN_U16 ? step : 0;
    }
    return largest_hz;
}

/* A count a slow period is 60 * CONFIG_SLOW_HZ / counts rpm; the gain grows with the bandwidth. */
int32_t margin_resolution_bw_hz(const struct params *p, const struct tuning *t)
{
    const int64_t allowed_q16 = (int64_t)MARGIN_COUNTS_ASK * t->i_max_q15 * 65536 * p->encoder_counts; /* below 2^51 */
    const int64_t asked_q16 = (int64_t)t->speed_kp_q16 * 60 * 16 * CONFIG_SLOW_HZ;
    const int64_t bw = allowed_q16 * p->speed_bw_hz / asked_q16;
    return scale_clamp(bw, 0, INT32_MAX);
}

/* ---- position ---- */

/*
 * The open speed loop's lag beyond 90 degrees at x times its bandwidth, in 65536ths of a turn: integral, current loop and
 * delay. Range: 0 < x <= 2.
 */
static int32_t speed_lag_u16(int32_t x_q12, const struct params *p)
{
    const int32_t hz_q12 = x_q12 * p->speed_bw_hz;
    const int32_t integral = (int32_t)(atan2_q32(1 << 10, x_q12) >> 16);
    const int32_t current = (int32_t)(atan2_q32(hz_q12, p->current_bw_hz * 4096) >> 16);
    const int64_t turn_us = (int64_t)TURN_U16 * delay_us(p->torque_mean_ms);
    return integral + current + (int32_t)((turn_us * hz_q12 / 1000000) >> 12);
}

/* 1 + 1 / L at a frequency of x times the speed loop's bandwidth: Q15. */
struct complex_q15 {
    int64_t real, imaginary;
};

static struct complex_q15 one_plus_inverse(int32_t x_q12, const struct params *p)
{
    const int64_t x2_q24 = (int64_t)x_q12 * x_q12;
    const int64_t n2_q24 = 16 * x2_q24 * x2_q24 / (16 * x2_q24 + (1 << 24)); /* (4 x^2)^2 / (16 x^2 + 1) */
    const int64_t n_q15 = mtpa_root(n2_q24 << 6);
    const uint32_t lag_u16 = (uint32_t)(QUARTER_U16 + speed_lag_u16(x_q12, p));
    const cossin_t c = cossin_q15(lag_u16 << 16);
    return (struct complex_q15){32768 + ((n_q15 * c.cos) >> 15), (n_q15 * c.sin) >> 15};
}

/* Where x |1 + 1 / L| reaches the position loop's bandwidth over the speed loop's, from below. */
static int32_t crossover_q12(int32_t position_bw_hz, const struct params *p)
{
    int32_t below = 0;
    for (int32_t step = X_MAX_Q12 / 2; step > 0; step /= 2) {
        const struct complex_q15 d = one_plus_inverse(below + step, p);
        const int64_t size_q15 = mtpa_root(d.real * d.real + d.imaginary * d.imaginary);
        below += size_q15 * (below + step) * p->speed_bw_hz < (int64_t)position_bw_hz << 27 ? step : 0;
    }
    return below + 1;
}

int32_t margin_of_position_u16(int32_t position_bw_hz, const struct params *p)
{
    const struct complex_q15 d = one_plus_inverse(crossover_q12(position_bw_hz, p), p);
    return QUARTER_U16 - ((int32_t)atan2_q32((int32_t)d.imaginary, (int32_t)d.real) >> 16);
}

int32_t margin_position_bw_hz(const struct params *p)
{
    int32_t largest_hz = 0;
    for (int32_t step = POSITION_BW_STEP_HZ; step > 0; step /= 2) {
        const int32_t hz = largest_hz + step;
        largest_hz += hz < p->speed_bw_hz && margin_of_position_u16(hz, p) >= POSITION_MARGIN_U16 ? step : 0;
    }
    return largest_hz;
}

/* SPDX-License-Identifier: MIT */
/*
 * What bandwidths leave a phase margin of MARGIN_DEG: the drive refuses more, and names the largest that works. Thread.
 *
 * Current loop: delay.h. With voltages that act at once the limit is a = 1, 60 degrees of margin: there a sample's whole error
 * is gone at the next one. More would overshoot and swing from sample to sample, long before the margin is 45 degrees.
 *
 * Speed loop. L = w/s (1 + w/(4s)) crosses over at 1.0291 w. From the 90 degrees there go
 *   13.65 degrees to the integral, atan(1/4.1166),
 *   the lag of the current loop, atan(1.0291 f / current_bw_hz),
 *   the delay: the estimate is the mean of a slow period, half of it old; what it asks for is held for one, half of it again;
 *   half of one for each further one in the mean of torque_mean_ms;
 *   a PWM period until it is read and taken, however often that is sampled; and half the distance of two edges, four a slow
 *   period (below that speed the estimate is older, and the loop's gains follow it: speed_loop.h).
 * Resolution. Edges stand up to a tenth of a count off, until the estimate has learned where. So much within a slow period may
 * ask for the largest current, a count for MARGIN_COUNTS_ASK times that.
 */
#ifndef FIRMWARE_SETTINGS_MARGINS_H
#define FIRMWARE_SETTINGS_MARGINS_H

#include <stdint.h>

#include "firmware/settings/params.h"
#include "firmware/settings/tuning.h"

#define MARGIN_DEG        45
#define MARGIN_COUNTS_ASK 10

/* The largest current_bw_hz with the margin, with so many samples a PWM period. */
int32_t margin_current_bw_hz(enum pwm_update update, int32_t samples);

/* The phase margin of the current loops at a bandwidth, in 65536ths of a turn. Range: up to the largest bandwidth. */
int32_t margin_of_current_u16(int32_t current_bw_hz, enum pwm_update update, int32_t samples);

/* The phase margin of the speed loop at a bandwidth, in 65536ths of a turn. Range: 1 Hz and more. */
int32_t margin_of_speed_u16(int32_t speed_bw_hz, int32_t current_bw_hz, int32_t torque_mean_ms);

/*
 * By how much the open speed loop lags beyond 90 degrees at x times its bandwidth, x Q12, in 65536ths of a turn: integral,
 * current loop and delay. Range: 0 < x <= 2.
 */
int32_t margin_lag_u16(int32_t x_q12, const struct params *p);

/* The largest speed_bw_hz with the margin; 0 if there is none. Some hundred cycles a bit. */
int32_t margin_speed_bw_hz(int32_t current_bw_hz, int32_t torque_mean_ms);

/* The largest speed_bw_hz that the encoder resolves with this inertia: of `t`, whose gains are for p's bandwidth. */
int32_t margin_resolution_bw_hz(const struct params *p, const struct tuning *t);

#endif

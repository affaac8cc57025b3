/* SPDX-License-Identifier: MIT */
/*
 * Bandwidths that leave a phase margin of MARGIN_DEG: the drive refuses higher ones and names the largest that works. Thread.
 *
 * Current loop: delay.h. With voltages that act at once the limit is a = 1, 60 degrees of margin: a sample's whole error is
 * then gone at the next. More would overshoot and oscillate from sample to sample, long before the margin falls to 45 degrees.
 *
 * Speed loop. L = w/s (1 + w/(4s)) crosses over at 1.0291 w. From the 90 degrees, subtract
 *   13.65 degrees for the integral, atan(1/4.1166),
 *   the lag of the current loop, atan(1.0291 f / current_bw_hz),
 *   the delay: half a slow period because the estimate is a mean over one; another half because its output is held for one;
 *   half of one for each further one in the mean of torque_mean_ms;
 *   a PWM period for reading and applying it, at any sampling rate; and half the time between two edges, four a slow
 *   period (below that speed the estimate is older, and the loop's gains follow it: speed_loop.h).
 * Resolution. Edges are up to a tenth of a count off until the estimate has learned their places. That error within a slow
 * period may call for at most the largest current, a whole count for MARGIN_COUNTS_ASK times that.
 */
#ifndef FIRMWARE_SETTINGS_MARGINS_H
#define FIRMWARE_SETTINGS_MARGINS_H

#include <stdint.h>

#include "firmware/settings/params.h"
#include "firmware/settings/tuning.h"

#define MARGIN_DEG        45
#define MARGIN_COUNTS_ASK 10

/* The largest current_bw_hz with the margin, for this number of samples a PWM period. */
int32_t margin_current_bw_hz(enum pwm_update update, int32_t samples);

/* The phase margin of the current loops at a bandwidth, in 65536ths of a turn. Range: up to the largest bandwidth. */
int32_t margin_of_current_u16(int32_t current_bw_hz, enum pwm_update update, int32_t samples);

/* The phase margin of the speed loop at a bandwidth, in 65536ths of a turn. Range: 1 Hz and more. */
int32_t margin_of_speed_u16(int32_t speed_bw_hz, int32_t current_bw_hz, int32_t torque_mean_ms);

/*
 * The open speed loop's lag beyond 90 degrees at x times its bandwidth, x Q12, in 65536ths of a turn: integral, current loop
 * and delay. Range: 0 < x <= 2.
 */
int32_t margin_lag_u16(int32_t x_q12, const struct params *p);

/* The largest speed_bw_hz with the margin; 0 if there is none. Some hundred cycles a bit. */
int32_t margin_speed_bw_hz(int32_t current_bw_hz, int32_t torque_mean_ms);

/* The largest speed_bw_hz the encoder resolves with this inertia: from `t`, whose gains are for p's bandwidth. */
int32_t margin_resolution_bw_hz(const struct params *p, const struct tuning *t);

#endif

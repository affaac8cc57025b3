/* SPDX-License-Identifier: MIT */
/*
 * The delay from sample to voltage: the one place that knows what PWM update mode (drivers/fabric/pwm.h) and samples per period
 * mean for control.
 *
 * One sample a period, in the middle of the low sides' on-time. A winding integrates: from one sample to the next its current
 * changes by T / L times the mean voltage between them. A phase rises once before the high sides' middle and falls once after
 * it, each set by half of its compare. With u(k) for the voltage calculated from sample k, that mean is
 *
 *   VALLEY  u(k - 1): both edges come from the old compare. Its middle is 3 half periods after its sample
 *   ENDS    (u(k - 1) + u(k)) / 2: the rise comes from the old one, the fall from the new. 2 half periods
 *   ONCE    u(k): both come from the new one. 1 half period
 *
 * exactly, for any on-time and any position of the edges in the period: in ONCE the interrupt's time up to its last compare
 * adds no delay, it bounds the on-time that can still be met. A phase that is on for longer falls back to ENDS.
 *
 * So with a gain of L 2 pi f the loop is, with z one period,
 *
 *   L(z) = a D(z) / (z - 1),  a = 2 pi f T,  D = 1 / z, (1 + 1 / z) / 2, 1
 *
 * and at an angle of x per period, for h half periods,
 *
 *   |L| = 1 at a = 2 sin(x / 2), or a = 2 tan(x / 2) for ENDS;  margin there = 90 degrees - h x / 2.
 *
 * Two samples a period, in the middle of the low sides' and of the high sides' on-time. T and z are then half a PWM period.
 * Between two samples a phase switches once, as its compare says: it rises after one and falls after the other, so the mean
 * voltage between them follows one compare entirely.
 *
 *   VALLEY  is refused: every second sample would have no effect
 *   ENDS    u(k - 1), in effect from the next end, which is the next sample: like VALLEY with one
 *   ONCE    u(k)
 *
 * A phase with too long an on-time rises before its new compare is ready, one with too short an on-time falls before it. Both
 * keep the old compare for half a period. They occur together, as the longest and the shortest of three pulses: the voltage
 * between these two phases is then half new and half old in each half period, D = (1 + 1 / z) / 2, as for ENDS with one sample.
 *
 * ==== margins ====
 *
 * Bandwidths that leave a phase margin of MARGIN_DEG: the drive refuses higher ones and names the largest that works. Thread.
 *
 * Current loop: above. With voltages that act at once the limit is a = 1, 60 degrees of margin: a sample's whole error is
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
 *
 * Position loop. A gain w_p before the closed speed loop gives
 *
 *   L_p = w_p / s * L / (1 + L),  L = w / s (1 + w / (4 s)) e^(-s delay) / (1 + s / w_current)
 *
 * with L and its delay as above. With 1 / L = n at an angle of `lag`, L / (1 + L) = 1 / (1 + n e^(j lag)): at the
 * crossover f, where f |1 + n e^(j lag)| is f_p, the margin is 90 degrees less the angle of that number. We require 60 degrees:
 * then |L_p / (1 + L_p)| does not exceed 1, and the shaft does not overshoot its target.
 */
#ifndef FIRMWARE_SETTINGS_MARGINS_H
#define FIRMWARE_SETTINGS_MARGINS_H

#include <stdint.h>

#include "drivers/fabric/pwm.h"
#include "firmware/settings/params.h"
#include "firmware/settings/tuning.h"

/* The mode with the same D and one sample a period. */
static inline enum pwm_update delay_alike(enum pwm_update update, int32_t samples)
{
    return samples == 2 && update == PWM_UPDATE_ENDS ? PWM_UPDATE_VALLEY : update;
}

/* From a sample to the middle of its voltage, in halves of the sampling period. */
static inline int32_t delay_halves(enum pwm_update update, int32_t samples)
{
    return 3 - (int32_t)delay_alike(update, samples);
}

#define MARGIN_DEG          45
#define MARGIN_POSITION_DEG 60
#define MARGIN_COUNTS_ASK   10

/* The angle is then known to 11 degrees at rest; with half of them an alignment fails from some angles. */
#define MARGIN_COUNTS_A_POLE_PAIR 16

/* The largest current_bw_hz with the margin, for this number of samples a PWM period. */
int32_t margin_current_bw_hz(enum pwm_update update, int32_t samples);

/* The phase margin of the current loops at a bandwidth, in 65536ths of a turn. Range: up to the largest bandwidth. */
int32_t margin_of_current_u16(int32_t current_bw_hz, enum pwm_update update, int32_t samples);

/* The phase margin of the speed loop at a bandwidth, in 65536ths of a turn. Range: 1 Hz and more. */
int32_t margin_of_speed_u16(int32_t speed_bw_hz, int32_t current_bw_hz, int32_t torque_mean_ms);

/* The largest speed_bw_hz with the margin; 0 if there is none. Some hundred cycles a bit. */
int32_t margin_speed_bw_hz(int32_t current_bw_hz, int32_t torque_mean_ms);

/* The largest speed_bw_hz the encoder resolves with this inertia: from `t`, whose gains are for p's bandwidth. */
int32_t margin_resolution_bw_hz(const struct params *p, const struct tuning *t);

/* The phase margin of the position loop at a bandwidth, in 65536ths of a turn, rounded. Range: 1 Hz ... speed_bw_hz. */
int32_t margin_of_position_u16(int32_t position_bw_hz, const struct params *p);

/* The largest position_bw_hz with the margin; 0 if there is none. About 100 000 cycles. */
int32_t margin_position_bw_hz(const struct params *p);

#endif

/* SPDX-License-Identifier: MIT */
/*
 * The position loop's margin: a gain w_p before the closed speed loop gives
 *
 *   L_p = w_p / s * L / (1 + L),  L = w / s (1 + w / (4 s)) e^(-s delay) / (1 + s / w_current)
 *
 * with L and its delay as in margins.h. With 1 / L = n at an angle of `lag`, L / (1 + L) = 1 / (1 + n e^(j lag)): at the
 * crossover f, where f |1 + n e^(j lag)| is f_p, the margin is 90 degrees less the angle of that number. We require 60 degrees:
 * then |L_p / (1 + L_p)| does not exceed 1, and the shaft does not overshoot its target. Thread.
 */
#ifndef FIRMWARE_SETTINGS_MARGIN_POSITION_H
#define FIRMWARE_SETTINGS_MARGIN_POSITION_H

#include <stdint.h>

#include "firmware/settings/params.h"

#define MARGIN_POSITION_DEG 60

/* The phase margin of the position loop at a bandwidth, in 65536ths of a turn, rounded. Range: 1 Hz ... speed_bw_hz. */
int32_t margin_of_position_u16(int32_t position_bw_hz, const struct params *p);

/* The largest position_bw_hz with the margin; 0 if there is none. About 100 000 cycles. */
int32_t margin_position_bw_hz(const struct params *p);

#endif

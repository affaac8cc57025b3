/* SPDX-License-Identifier: MIT */
/*
 * Voltages beyond the circle, up to six-step.
 *
 * Beyond vbus / sqrt(3) a phase would need more than the bus, and stays at one end of it for a part of the turn: the modulator
 * cuts what is too much. The fundamental that is left is smaller than what was asked for, by a share that is known:
 *     length   1 / sqrt(3)   0.6     0.667   0.8     1       2          of vbus
 *     of six-step's, 2 / pi   0.907   0.930   0.957   0.970   0.981   0.995
 * So a vector is made longer by the inverse of that before it is cut, and what reaches the motor is the fundamental that the
 * controllers asked for: their gains hold, what they publish is what there is, and the limits of current control and field
 * weakening are a larger circle and nothing else. The passage is smooth, since length and fundamental part without a step.
 * The sixth harmonics that the cut makes are in the currents, and stay there. Cutting the duties is the shortest way from a
 * vector to the hexagon (minimum-magnitude error); the inverse of its gain: Hava, Kerkman, Lipo, "Carrier-based PWM-VSI
 * overmodulation strategies", IEEE Trans. Power Electron. 13(4), 1998.
 */
#ifndef FIRMWARE_CONTROL_OVERMODULATION_H
#define FIRMWARE_CONTROL_OVERMODULATION_H

#include <stdint.h>

#include "firmware/settings/rates.h"

/* Squares of the lengths between which a vector becomes longer: vbus / sqrt(3) and six-step's. */
#define OVERMODULATION_FROM    ((int32_t)((int64_t)CONFIG_BUS_STEPS * CONFIG_BUS_STEPS / 3))
#define OVERMODULATION_SQUARES ((int32_t)((int64_t)CONFIG_BUS_STEPS * CONFIG_BUS_STEPS * 4716 / 65536))

#define OVERMODULATION_BITS      5 /* of the table's places */
#define OVERMODULATION_GAIN_BITS 12

/* By how much a vector is made longer, at equal steps of its square: Q12, 1.0 to 3.15. The longest is twice the bus. */
extern const uint16_t overmodulation_gain_q12[(1 << OVERMODULATION_BITS) + 1];

#endif

/* SPDX-License-Identifier: MIT */
/*
 * Voltages beyond the circle, up to six-step.
 *
 * Beyond vbus / sqrt(3) a phase would need more than the bus, so it saturates for part of the turn: the modulator clips the
 * excess. The remaining fundamental is smaller than asked for, by a known factor:
 *     length   1 / sqrt(3)   0.6     0.667   0.8     1       2          of vbus
 *     of six-step's, 2 / pi   0.907   0.930   0.957   0.970   0.981   0.995
 * So a vector is lengthened by the inverse before clipping, and the motor gets the fundamental the controllers asked for: their
 * gains hold, published voltages are real, and to current control and field weakening it is just a larger circle. The
 * transition is smooth: length and fundamental diverge without a step. The sixth harmonics from clipping appear in the currents
 * and remain. Clipping the duties is the shortest way from a vector to the hexagon (minimum-magnitude error); the inverse of
 * its gain: Hava, Kerkman, Lipo, "Carrier-based PWM-VSI overmodulation strategies", IEEE Trans. Power Electron. 13(4), 1998.
 */
#ifndef FIRMWARE_CONTROL_OVERMODULATION_H
#define FIRMWARE_CONTROL_OVERMODULATION_H

#include <stdint.h>

#include "firmware/settings/rates.h"

/* The squared lengths between which a vector is lengthened: vbus / sqrt(3) and six-step's. */
#define OVERMODULATION_FROM    ((int32_t)((int64_t)CONFIG_BUS_STEPS * CONFIG_BUS_STEPS / 3))
#define OVERMODULATION_SQUARES ((int32_t)((int64_t)CONFIG_BUS_STEPS * CONFIG_BUS_STEPS * 4716 / 65536))

#define OVERMODULATION_BITS      5 /* of the table's index */
#define OVERMODULATION_GAIN_BITS 12

/* The lengthening factor at equal steps of the vector's square: Q12, 1.0 to 3.15. The longest is twice the bus. */
extern const uint16_t overmodulation_gain_q12[(1 << OVERMODULATION_BITS) + 1];

#endif

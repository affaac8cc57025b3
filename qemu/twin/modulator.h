/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A delta-sigma modulator of second order with one bit: two integrators in a loop, whose noise leaves with (1 - 1/z)^2 and
 * whose signal passes as it is (R. Schreier, G. C. Temes, "Understanding Delta-Sigma Data Converters", 2005, chapter 3).
 * With v = +1 for a one and -1 for a zero,
 *
 *   first += u - v,  second += first - v,  v = the sign of second.
 *
 * The sum of u - v over any time is what `first` has grown by. That stays within 3, so the mean of n bits is that of the
 * input within 6 / n as long as no integrator saturates, which it does not within the linear range, |u| <= 25/32.
 *
 * The part: AMC1306M25 (Texas Instruments, SBAS734). Full scale is +-320 mV, linear are +-250 mV: 89.06 % ones. At full scale
 * or beyond all bits are the same but one in 128, which shows that it lives. Clock 5 to 21 MHz. */
#ifndef TWIN_MODULATOR_H
#define TWIN_MODULATOR_H

#include <stdbool.h>

struct modulator {
    double first, second; /* in full scales */
    bool bit;
    unsigned clipped; /* clocks at full scale, modulo 128 */
};

/* The next bit, for an input in full scales. */
bool modulator_clock(struct modulator *m, double input);

#endif

/* SPDX-License-Identifier: MIT */
/*
 * Compares the counts per electrical turn with what pole_pairs and encoder_counts predict. If they do not fit, one of the two
 * is wrong, and one electrical turn cannot always tell which: if another whole number of pole pairs would fit, that is named
 * first, since pole pairs are whole numbers and wrong counts rarely give one; four times the counts means lines entered as
 * counts. Either way both values that would fit are reported.
 */
#ifndef FIRMWARE_COMMISSION_ENCODER_FIT_H
#define FIRMWARE_COMMISSION_ENCODER_FIT_H

#include <stdint.h>

enum encoder_fit_verdict {
    ENCODER_FITS,
    ENCODER_POLE_PAIRS,
    ENCODER_COUNTS,
};

struct encoder_fit {
    enum encoder_fit_verdict verdict;
    int32_t pole_pairs;     /* that would fit if encoder_counts is right; 0: none would */
    int32_t encoder_counts; /* that would fit if pole_pairs is right */
};

/*
 * `two_turns_q4`: sixteenths of a count in two electrical turns, one each way, positive. The threshold is 1.3 % and half a
 * count: disc eccentricity and the rotor's swinging stay below the first, uneven edges below the second; two counts in a
 * hundred do not. Slow loop; 32-bit divisions.
 */
struct encoder_fit encoder_fit(int32_t two_turns_q4, int32_t pole_pairs, int32_t encoder_counts);

#endif

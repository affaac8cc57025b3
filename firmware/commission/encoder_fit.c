/* SPDX-License-Identifier: MIT */
#include "firmware/commission/encoder_fit.h"

#include <stdbool.h>
#include <stddef.h>

#include "drivers/fabric/encoder.h"
#include "lib/q15.h"

#define OFF_BY_ONE_IN  77  /* 1.3 % */
#define SNAP_ONE_IN    100 /* a standard count this close is meant */
#define COUNTS_MOST    (1 << 19)
#define POLE_PAIRS_MAX 50

/* Lines per turn that makers offer; the counts are four times these. */
static const uint16_t usual_lines[] = {100,  120,  125,  128,  180,  200,  250,  256,   300,  360,  400,
                                       500,  512,  600,  625,  720,  800,  900,  1000,  1024, 1080, 1200,
                                       1250, 1440, 1500, 1600, 1800, 2000, 2048, 2250,  2400, 2500, 2880,
                                       3000, 3600, 4000, 4096, 5000, 7200, 8192, 10000, 16384};

/* The measurement is a few thousandths off: rounds it to a standard count close by, or else to whole lines. */
static int32_t usual_counts(int32_t counts)
{
    int32_t best = q15_clamp((counts + 2) / 4 * 4, (int32_t)ENCODER_COUNTS_MIN, (int32_t)ENCODER_COUNTS_MAX);
    int32_t off = counts / SNAP_ONE_IN;
    for (size_t i = 0; i < sizeof usual_lines / sizeof usual_lines[0]; i++) {
        const int32_t distance = q15_abs(counts - 4 * usual_lines[i]);
        if (distance < off) {
            best = 4 * usual_lines[i];
            off = distance;
        }
    }
    return best;
}

/* Pole pairs within a tenth of a whole number, or 0. */
static int32_t whole_pole_pairs(int32_t counts_two_turns, int32_t encoder_counts)
{
    const int32_t tenths = (20 * encoder_counts + counts_two_turns / 2) / counts_two_turns;
    const int32_t nearest = (tenths + 5) / 10;
    return q15_abs(tenths - 10 * nearest) <= 1 && nearest >= 1 && nearest <= POLE_PAIRS_MAX ? nearest : 0;
}

struct encoder_fit encoder_fit(int32_t counts_two_turns, int32_t pole_pairs, int32_t encoder_counts)
{
    const int32_t seen = q15_clamp(counts_two_turns, 1, COUNTS_MOST);
    const int32_t off = seen * pole_pairs - 2 * encoder_counts;
    if (q15_abs(off) < 2 * encoder_counts / OFF_BY_ONE_IN) {
        return (struct encoder_fit){ENCODER_FITS, pole_pairs, encoder_counts};
    }
    const int32_t whole = whole_pole_pairs(seen, encoder_counts);
    const bool lines = q15_abs(seen * pole_pairs - 8 * encoder_counts) < 8 * encoder_counts / OFF_BY_ONE_IN;
    const bool pairs = whole != 0 && whole != pole_pairs && !lines;
    return (struct encoder_fit){pairs ? ENCODER_POLE_PAIRS : ENCODER_COUNTS, whole,
                                usual_counts(seen * pole_pairs / 2)};
}

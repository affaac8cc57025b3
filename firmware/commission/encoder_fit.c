/* SPDX-License-Identifier: MIT */
#include "firmware/commission/encoder_fit.h"

#include <stdbool.h>
#include <stddef.h>

#include "drivers/fabric/encoder.h"
#include "lib/q15.h"

#define OFF_BY_ONE_IN  77  /* 1.3 % */
#define SNAP_ONE_IN    100 /* a standard count this close is meant */
#define EDGES_Q4       8   /* half a count in two turns */
#define TWO_TURNS_Q4   32  /* of a pole pair, per count of a turn of the shaft */
#define COUNTS_MOST_Q4 (1 << 23)
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
static int32_t whole_pole_pairs(int32_t two_turns_q4, int32_t encoder_counts)
{
    const int32_t tenths = (10 * TWO_TURNS_Q4 * encoder_counts + two_turns_q4 / 2) / two_turns_q4;
    const int32_t nearest = (tenths + 5) / 10;
    return q15_abs(tenths - 10 * nearest) <= 1 && nearest >= 1 && nearest <= POLE_PAIRS_MAX ? nearest : 0;
}

static bool fits(int32_t seen_q4, int32_t pole_pairs, int32_t encoder_counts)
{
    const int32_t expected_q4 = TWO_TURNS_Q4 * encoder_counts;
    return q15_abs(seen_q4 * pole_pairs - expected_q4) < expected_q4 / OFF_BY_ONE_IN + EDGES_Q4 * pole_pairs;
}

struct encoder_fit encoder_fit(int32_t two_turns_q4, int32_t pole_pairs, int32_t encoder_counts)
{
    const int32_t seen_q4 = q15_clamp(two_turns_q4, 1, COUNTS_MOST_Q4);
    if (fits(seen_q4, pole_pairs, encoder_counts)) {
        return (struct encoder_fit){ENCODER_FITS, pole_pairs, encoder_counts};
    }
    const int32_t whole = whole_pole_pairs(seen_q4, encoder_counts);
    const bool pairs = whole != 0 && whole != pole_pairs && !fits(seen_q4, pole_pairs, 4 * encoder_counts);
    return (struct encoder_fit){pairs ? ENCODER_POLE_PAIRS : ENCODER_COUNTS, whole,
                                usual_counts((seen_q4 * pole_pairs + TWO_TURNS_Q4 / 2) / TWO_TURNS_Q4)};
}

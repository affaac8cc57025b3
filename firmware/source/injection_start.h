/* SPDX-License-Identifier: MIT */
/*
 * Start by saliency, at standstill (control/injection.h):
 *
 *   sweep      the voltage along eight angles over half a turn: (y_d + j y_q) exp(2j a), summed, is 8 2 U T Y1 exp(2j m). This
 *              gives the magnets' axis up to half a turn, and the current response per degree. Too little is refused
 *   lock       tracks the angle from there
 *   polarity   d current in either direction, and y_d with each. Saturation shows the north pole: current along the magnets
 *              saturates the iron more, and the response is larger. Both must differ by six sigma; if not, repeats with half
 *              as much current again, up to twice. Omitted if reluctance outweighs the magnets: there some rotors respond
 *              less along the magnets, those with bridges that the magnets saturate, and some more (Lelli et al., ICEM 2024,
 *              doi 10.1109/ICEM60801.2024.10700403)
 *   push       in that case, or if saturation gave no result: q current for some milliseconds, then of opposite sign; then
 *              both in reverse order, and again as at first. If north and south are confused, the rotor moves backwards.
 *              Longer and longer, until both differ by 12 degrees, and once more to confirm it. A rotor that does not
 *              move, or is moved by something else, is refused
 */
#ifndef FIRMWARE_SOURCE_INJECTION_START_H
#define FIRMWARE_SOURCE_INJECTION_START_H

#include <stdbool.h>
#include <stdint.h>

struct axis;

#define PUSH_WINDOWS 3

enum injection_result {
    INJECTION_RUNNING,
    INJECTION_DONE,     /* angle and north are known, and tracked */
    INJECTION_SALIENCY, /* refused: too little current response per degree */
    INJECTION_POLARITY, /* refused: neither saturation nor pushes gave the north pole */
};

struct injection_start {
    uint32_t step;
    uint32_t ms;    /* of it */
    uint32_t angle; /* of the sweep */
    int32_t sum_re, sum_im, sum_straight;
    int32_t radian;   /* response per radian */
    int32_t straight; /* response along the voltage, mean of all angles: 2 U T Y0 */
    uint32_t tries;
    int32_t i_q15;         /* of the polarity test */
    int32_t with, against; /* responses with each sign of it: sums, and squares of the milliseconds' */
    int64_t with_squares, against_squares;
    bool polarity_found;              /* saturation has shown the north pole */
    uint32_t push_ms;                 /* in each direction */
    uint32_t searches;                /* of three windows */
    int32_t direction;                /* result of the last conclusive push: 1 forward, -1 backward, 0 none yet */
    uint32_t push_from_q32;           /* angle before a push */
    int32_t pushed_q32[PUSH_WINDOWS]; /* and its motion */
    uint32_t result;                  /* enum injection_result of the last start */
    int32_t detail_q8;                /* response per degree, LSB */
};

/* True if the parameters ask for it. Any context. */
bool injection_wanted(const struct axis *a);

/* Slow loop, bridge on, LOOP_INJECTION. */
void injection_begin(struct axis *a);

/*
 * True if voltages must be held now, not currents: during lock, shorted windings brake a rotor that the wiring test has moved.
 * Slow loop.
 */
bool injection_brakes(const struct axis *a);

/* One step a millisecond. Slow loop. */
enum injection_result injection_start_step(struct axis *a);

#endif

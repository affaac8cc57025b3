/* SPDX-License-Identifier: MIT */
/* Sine and cosine together from a binary angle, by one table of chords. */
#ifndef LIB_TRIG_H
#define LIB_TRIG_H

#include "lib/q15.h"

/**
 * 1024 chords of the sine over one turn, and a quarter more for the cosine. A word is V * 4096 + slope: V is the sine at the
 * chord's start and slope its rise, both in 1/8 LSB of Q15; V includes half an LSB, so a shift rounds.
 */
extern const int32_t trig_chords[1280];

/** The chord `word` at part_q12 (0...4095 of 4096), in Q30, half an LSB of Q15 included; subtract 16384 for the sine in Q30. */
static inline int32_t trig_on_chord_q30(int32_t word, int32_t part_q12)
{
    const int32_t slope = (int32_t)((uint32_t)word << 20) >> 20;

    return word + slope * (part_q12 - 1); /* the extra slope in part is the one in word */
}

/**
 * cos and sin of angle_q32 (2^32 = one turn; it wraps by itself).
 * Q15. At the 65536 angles of 16 bits (in the upper half of angle_q32) within 0.83 LSB of the exact value; exactly 0 and
 * +-32768 at the quadrants; cos(-x) = cos(x), sin(-x) = -sin(x), sin(x + quarter) = cos(x) to the bit. At any angle within
 * 0.85 LSB; the lower 10 bits of the angle have no effect. |(cos, sin)| <= 32768.75 everywhere, which the Park transform
 * relies on. tests/lib sweeps all 2^22 results.
 * Saturation: none needed. Context: any; re-entrant. The same instructions for every angle; two table reads; 15 cycles in
 * registers (`make bench`, cossin_q15.registers), plus loading the table's address.
 *
 * A chord over 1/1024 turn lies up to 0.154 LSB inside the circle. Its ends are chosen among the neighbouring eighths to avoid
 * ties at 16-bit angles: mirrored angles then give mirrored values.
 */
static inline cossin_t cossin_q15(uint32_t angle_q32)
{
    const int32_t *const chord = &trig_chords[angle_q32 >> 22];
    const int32_t part_q12 = (int32_t)((angle_q32 >> 10) & 0xFFFU);
    const int32_t sine = chord[0];
    const int32_t cosine = chord[256];

    return (cossin_t){trig_on_chord_q30(cosine, part_q12) >> 15, trig_on_chord_q30(sine, part_q12) >> 15};
}

#endif

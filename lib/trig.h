/* SPDX-License-Identifier: MIT */
/* Sine and cosine together from a binary angle, by one table of chords. */
#ifndef LIB_TRIG_H
#define LIB_TRIG_H

#include "lib/q15.h"

/**
 * sin(2 pi i / 1024) in Q24, 2^-19 too large, for i = 0...1280: one turn, a quarter more for the cosine, and the end of the
 * last chord.
 */
extern const int32_t trig_sine_q24[1281];

/**
 * cos and sin of angle_u16 (65536 = one turn; bits above 16 are ignored).
 * Q15, within 0.6 LSB of the exact value; exactly 0 and +-32768 at the quadrants; cos(-x) = cos(x), sin(-x) = -sin(x),
 * sin(x + quarter) = cos(x) to the bit. tests/lib sweeps all 65536 angles.
 * Context: any. The same 20 or so instructions for every angle; four table reads.
 *
 * A chord over 1/1024 turn lies up to 0.154 LSB inside the circle. The table's circle is larger by 36 parts in 2^24, which
 * shares that between inside and outside; of the values about the middle (39) it is the nearest with which no angle comes
 * out as a tie. So, the sum of a chord being exact (24 + 6 bits), mirrored angles give mirrored values.
 */
static inline cossin_t cossin_q15(uint32_t angle_u16)
{
    const int32_t *const chord = &trig_sine_q24[(angle_u16 >> 6) & 1023U];
    const int32_t part_q6 = (int32_t)(angle_u16 & 63U);
    const int32_t sin_q30 = chord[0] * 64 + (chord[1] - chord[0]) * part_q6;
    const int32_t cos_q30 = chord[256] * 64 + (chord[257] - chord[256]) * part_q6;

    return (cossin_t){q15_from_q30(cos_q30), q15_from_q30(sin_q30)};
}

#endif

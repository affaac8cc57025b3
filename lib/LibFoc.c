/* SPDX-License-Identifier: MIT */
/* The functions of LibFoc.h, in portable C with 64-bit sums: each reads its whole input before it writes. */
#define LIB_DEFINES /* by their plain names */
#include "lib/LibFoc.h"

#include "lib/pi.h"
#include "lib/polar.h"
#include "lib/thumb2.h"
#include "lib/trig.h"

#define INV_SQRT3_Q31 1239850262 /* 2^31 / sqrt(3) = 1239850262.2526 */

/* |value| < 2^62 */
static int32_t saturated(int64_t value)
{
    const int32_t low = (int32_t)(uint32_t)((uint64_t)value & UINT32_MAX);
    const int32_t high = (int32_t)(value >> 32);
    const int32_t excess = high ^ (low >> 31); /* 0 if the value fits; small otherwise */
    const int32_t beyond = (excess | -excess) >> 31;

    return (low & ~beyond) | ((INT32_MAX ^ (high >> 31)) & beyond);
}

/* sum / sqrt(3); |sum| <= 3 * 2^31, so the product stays below 2^62.8. */
static int32_t over_sqrt3(int64_t sum)
{
    const int64_t product_q31 = sum * INV_SQRT3_Q31 + (sum >> 2);

    return saturated((product_q31 + (INT64_C(1) << 30)) >> 31);
}

/* sum / 3 to nearest; |sum| <= 3 * 2^31. The product is right to a few units; the rest, 0...6, is divided exactly. */
static int64_t third(int64_t sum)
{
    const int64_t near = ((sum >> 2) * 0x55555555) >> 30;
    const int32_t rest = (int32_t)(sum - 3 * near);

    return near + ((rest * 21846 + 32768) >> 16);
}

void Clarke3_Lib_Do(const clarkeinput_type *threephasecurrent_ptr, clarkeoutput_type *twophaserefcurrent_ptr)
{
    const int64_t a = threephasecurrent_ptr->ia;
    const int64_t b = threephasecurrent_ptr->ib;
    const int64_t c = threephasecurrent_ptr->ic;

    twophaserefcurrent_ptr->ialpha = saturated(a - third(a + b + c));
    twophaserefcurrent_ptr->ibeta = over_sqrt3(b - c);
}

void ClarkeBC_Lib_Do(const clarkeinput_type *threephasecurrent_ptr, clarkeoutput_type *twophaserefcurrent_ptr)
{
    const int64_t b = threephasecurrent_ptr->ib;
    const int64_t c = threephasecurrent_ptr->ic;

    twophaserefcurrent_ptr->ialpha = saturated(-b - c);
    twophaserefcurrent_ptr->ibeta = over_sqrt3(b - c);
}

void ClarkeCA_Lib_Do(const clarkeinput_type *threephasecurrent_ptr, clarkeoutput_type *twophaserefcurrent_ptr)
{
    const int32_t a = threephasecurrent_ptr->ia;
    const int64_t c = threephasecurrent_ptr->ic;

    twophaserefcurrent_ptr->ialpha = a;
    twophaserefcurrent_ptr->ibeta = over_sqrt3(-(a + 2 * c));
}

/* From the chord's Q30, which may exceed the circle by less than an LSB of Q15, to LIB_TRIG_FRAC bits. */
static int32_t trig_frac(int32_t chord_q30)
{
    const int32_t value_q30 = q15_clamp(chord_q30 - Q15_HALF, -(1 << 30), 1 << 30);

#if LIB_TRIG_FRAC == 31
    return (int32_t)((uint32_t)value_q30 * 2U - (uint32_t)(value_q30 == 1 << 30)); /* 1.0 becomes INT32_MAX */
#elif LIB_TRIG_FRAC == 30
    return value_q30;
#else
    return (value_q30 + (1 << (29 - LIB_TRIG_FRAC))) >> (30 - LIB_TRIG_FRAC);
#endif
}

void SinCos_Lib_Do(uint32_t angle_q32, sincosoutput_type *sincosoutput_ptr)
{
    const int32_t *const chord = &trig_chords[angle_q32 >> 22];
    const int32_t part_q12 = (int32_t)((angle_q32 >> 10) & 0xFFFU);

    sincosoutput_ptr->cos = trig_frac(trig_on_chord_q30(chord[256], part_q12));
    sincosoutput_ptr->sin = trig_frac(trig_on_chord_q30(chord[0], part_q12));
}
LIB_NAMED_BY_FRAC(SinCos_Lib_Do)

/* The root of square <= 2^63, to nearest: one bit per iteration, the same 32 iterations for all data. */
static uint32_t root(uint64_t square)
{
    uint64_t rest = square;
    uint64_t found = 0U;

    for (uint64_t bit = UINT64_C(1) << 62; bit != 0U; bit >>= 2) {
        const uint64_t trial = found + bit;
        const uint64_t less = rest - trial; /* -2^63 or more, and 2^63 - 1 at most: the sign says whether it is taken */
        const uint64_t refused = (uint64_t)((int64_t)less >> 63);

        rest = less + (trial & refused);
        found = (found >> 1) + (bit & ~refused);
    }
    return (uint32_t)(found + (rest > found ? 1U : 0U));
}

void Polar_Lib_Do(const polarinput_type *polarinput_ptr, polaroutput_type *polaroutput_ptr)
{
    const int32_t x = polarinput_ptr->x;
    const int32_t y = polarinput_ptr->y;
    const uint32_t magnitude = root((uint64_t)((int64_t)x * x) + (uint64_t)((int64_t)y * y));

    polaroutput_ptr->magnitude = (int32_t)(magnitude > INT32_MAX ? INT32_MAX : magnitude);
    polaroutput_ptr->angle_q32 = atan2_q32(y, x);
}

/* x - y, clamped to +-limit */
static int32_t difference_within(int32_t x, int32_t y, int32_t limit)
{
    return q15_clamp(saturated((int64_t)x - y), -limit, limit);
}

void PI_Lib_Do(const piinput_type *piinput_ptr, pistate_type *pistate_ptr, pioutput_type *pioutput_ptr)
{
    const int32_t error = difference_within(piinput_ptr->reference, piinput_ptr->measured, PI_ERROR_MAX);
    const int32_t limit = q15_clamp(piinput_ptr->limit, 0, PI_OUTPUT_MAX);
    struct pi_q15 pi = {
        .kp_q9 = q15_clamp(pistate_ptr->kp_q9, 0, PI_KP_MAX_Q9),
        .ki_q15 = q15_clamp(pistate_ptr->ki_q15, 0, PI_KI_MAX_Q15),
        .integral_q9 = q15_clamp(pistate_ptr->integral_q9, -PI_INTEGRAL_MAX_Q9, PI_INTEGRAL_MAX_Q9),
    };

    pioutput_ptr->output = pi_q15_step(&pi, error, limit);
    pistate_ptr->integral_q9 = pi.integral_q9;
}

/* v - middle, which is at most 2^31 and never INT32_MIN, because middle is between the extremes. */
static int32_t centred(int32_t v, int32_t middle)
{
    const int32_t difference = (int32_t)((uint32_t)v - (uint32_t)middle);

    return difference == INT32_MIN ? INT32_MAX : difference;
}

void SVM_Lib_Do(const svminput_type *svminput_ptr, svmoutput_type *svmoutput_ptr)
{
    const svminput_type v = *svminput_ptr;
    const int32_t largest = q15_max(q15_max(v.va, v.vb), v.vc);
    const int32_t smallest = q15_min(q15_min(v.va, v.vb), v.vc);
    const int32_t middle = (largest & smallest) + ((largest ^ smallest) >> 1); /* half of the sum, rounded down */

    svmoutput_ptr->va = centred(v.va, middle);
    svmoutput_ptr->vb = centred(v.vb, middle);
    svmoutput_ptr->vc = centred(v.vc, middle);
}

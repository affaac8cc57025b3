/* SPDX-License-Identifier: MIT */
/*
 * Fourth stage beyond the circle: lengthens the vector (overmodulation.h) and clips its compares to the period. ISR, constant
 * time.
 *
 * A phase either stays at an end for the whole period or leaves it for at least dead times and shortest pulse: anything between
 * goes to the nearer. Lengthened vectors are in quarters of the loop's steps, so three times the circle stays within
 * lib/modulation.h's range.
 */
#ifndef FIRMWARE_CONTROL_STAGE_OVERMODULATE_H
#define FIRMWARE_CONTROL_STAGE_OVERMODULATE_H

#include "drivers/fabric/fabric.h"
#include "firmware/control/overmodulation.h"
#include "firmware/control/stage_modulate.h"

#define OVERMODULATE_COARSER      2 /* bits */
#define OVERMODULATE_SQUARE_SHIFT 12

/* From a square, 12 bits shorter, to a table index with 8 bits of fraction. */
#define OVERMODULATE_PLACE_Q15 \
    ((int32_t)((1LL << (OVERMODULATION_BITS + 8 + 15 + OVERMODULATE_SQUARE_SHIFT)) / OVERMODULATION_SQUARES))

/* Half of a pulse the PWM need not stretch: two dead times and the shortest pulse. */
#define OVERMODULATE_EDGE (CONFIG_DEAD_COUNTS + (CONFIG_MIN_PULSE_COUNTS + 1) / 2)

_Static_assert(CONFIG_SIX_STEPS <= 32766, "six-step's fundamental is within what the controllers ask for");
_Static_assert(CONFIG_SIX_STEPS > CONFIG_RADIUS_STEPS, "six-step is more than the circle");
_Static_assert(CONFIG_BUS_STEPS / 2 < 1 << 15, "twice the bus, in quarters of steps, within lib/modulation.h's range");

/* |v| <= CONFIG_SIX_STEPS. Result: quarters of steps. */
static inline dq_t overmodulate_longer(dq_t v)
{
    const int32_t beyond = v.d * v.d + v.q * v.q - OVERMODULATION_FROM;
    const int32_t square = q15_clamp(beyond, 0, OVERMODULATION_SQUARES - 1) >> OVERMODULATE_SQUARE_SHIFT;
    const int32_t place_q8 = (square * OVERMODULATE_PLACE_Q15) >> 15;
    const uint16_t *const gain_q12 = &overmodulation_gain_q12[place_q8 >> 8];
    const int32_t rise_q12 = gain_q12[1] - gain_q12[0];
    const int32_t longer_q12 = gain_q12[0] + ((rise_q12 * (place_q8 & 255)) >> 8);
    return (dq_t){(v.d * longer_q12) >> (OVERMODULATION_GAIN_BITS + OVERMODULATE_COARSER),
                  (v.q * longer_q12) >> (OVERMODULATION_GAIN_BITS + OVERMODULATE_COARSER)};
}

static inline uint32_t overmodulate_phase(int32_t half_on, int32_t share_q7)
{
    const int32_t compare =
        (half_on + share_q7 * (LOOP_DEAD >> OVERMODULATE_COARSER)) >> (LOOP_COMPARE_SHIFT - OVERMODULATE_COARSER);
    const int32_t pulsed = q15_clamp(compare, OVERMODULATE_EDGE, CONFIG_HALF_COUNTS - OVERMODULATE_EDGE);
    const int32_t low = compare < OVERMODULATE_EDGE / 2 ? 0 : pulsed;
    return (uint32_t)(compare > CONFIG_HALF_COUNTS - OVERMODULATE_EDGE / 2 ? CONFIG_HALF_COUNTS : low);
}

/* As modulate(). */
static inline void overmodulate(struct pwm_regs *pwm, dq_t wanted, cossin_t cs, alphabeta_t i, int32_t turn_q15)
{
    const dq_t v = overmodulate_longer(wanted);
    const int32_t a = v.d * cs.cos - v.q * cs.sin;
    const int32_t b = ((v.q * cs.cos + v.d * cs.sin) >> 15) * SIN60_Q15 - (a >> 1);
    const int32_t minus_c = a + b;
    const int32_t base = (LOOP_HALF >> OVERMODULATE_COARSER) - svm_middle(a, b, minus_c);

    const struct modulate_shares share = modulate_shares(i, turn_q15);
    pwm->COMPARE_A = overmodulate_phase(base + a, share.a_q7);
    pwm->COMPARE_B = overmodulate_phase(base + b, share.b_q7);
    pwm->COMPARE_C = overmodulate_phase(base - minus_c, -share.minus_c_q7);
}

#endif

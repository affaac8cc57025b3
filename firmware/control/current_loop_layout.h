/* SPDX-License-Identifier: MIT */
/*
 * Numbers for the interrupt's assembly: member offsets of struct current_loop, and the modulator's constants, which the C
 * stages also use. firmware/control/current_loop.c checks the offsets against the structure.
 */
#ifndef FIRMWARE_CONTROL_CURRENT_LOOP_LAYOUT_H
#define FIRMWARE_CONTROL_CURRENT_LOOP_LAYOUT_H

#include "firmware/settings/rates.h"
#include "lib/factors.h"

#define LOOP_ANGLE         0
#define LOOP_SPEED         4
#define LOOP_ANGLE_OFFSET  8
#define LOOP_SINE          12
#define LOOP_I_D_REF       16
#define LOOP_I_Q_REF       20
#define LOOP_KP_D          24
#define LOOP_KP_Q          28
#define LOOP_INTEGRAL_D    32
#define LOOP_INTEGRAL_Q    36
#define LOOP_TURN          40
#define LOOP_KI            44
#define LOOP_I_D           48
#define LOOP_I_Q           52
#define LOOP_V_D           56
#define LOOP_V_Q           60
#define LOOP_ENCODER_SCALE 64
#define LOOP_STATUS_MAX    68
#define LOOP_CIRCLE        80

/* The d voltage is limited to +-2^(bits - 1) steps, between half the circle and all of it: q always gets a share. */
#define LOOP_V_D_BITS 15

#define LOOP_CIRCLE_BITS  9                                  /* of the circle table's index */
#define LOOP_CIRCLE_SHIFT (LOOP_V_D_BITS - LOOP_CIRCLE_BITS) /* of v_d, to an index */
#define LOOP_CIRCLE_ZERO  (1 << (LOOP_CIRCLE_BITS - 1))      /* the index for v_d = 0 */

/* Fraction bits of a compare: a voltage in steps times a sine in Q15. */
#define LOOP_COMPARE_SHIFT (CONFIG_V_SHIFT + 15)

/*
 * The compare at zero voltage: half of half a period, plus a half to round. The lower half word is the factor the assembly has
 * in that register; it lengthens all three phases by 0.1 counts, which cancels in the line voltages.
 */
#define LOOP_HALF \
    ((((CONFIG_HALF_COUNTS << (LOOP_COMPARE_SHIFT - 1)) + (1 << (LOOP_COMPARE_SHIFT - 1))) & ~0xFFFF) | SIN60_Q15)

/* Half a dead time, for each 1/128 of share */
#define LOOP_DEAD (CONFIG_DEAD_COUNTS << (LOOP_COMPARE_SHIFT - 8))

/* Offset of the assembly handler's body, in bytes: tests enter there with their own base addresses. */
#define LOOP_BODY 16

#endif

/* SPDX-License-Identifier: MIT */
/*
 * What the interrupt's assembly has to know in numbers: where the members of struct current_loop are, and the modulator's
 * constants. firmware/control/current_loop.c holds them against the structure and firmware/settings/config.h.
 */
#ifndef FIRMWARE_CONTROL_CURRENT_LOOP_LAYOUT_H
#define FIRMWARE_CONTROL_CURRENT_LOOP_LAYOUT_H

#define LOOP_ANGLE        0
#define LOOP_SPEED        4
#define LOOP_ANGLE_OFFSET 8
#define LOOP_SINE         12
#define LOOP_I_D_REF      16
#define LOOP_I_Q_REF      20
#define LOOP_KP_D         24
#define LOOP_KP_Q         28
#define LOOP_INTEGRAL_D   32
#define LOOP_INTEGRAL_Q   36
#define LOOP_TURN         40
#define LOOP_KI           44
#define LOOP_I_D          48
#define LOOP_I_Q          52
#define LOOP_V_D          56
#define LOOP_V_Q          60
#define LOOP_ENCODER      64
#define LOOP_STATUS_MAX   68
#define LOOP_CIRCLE       72

#define LOOP_PWM_COUNTS  5000
#define LOOP_DEAD_COUNTS 100

#define LOOP_CIRCLE_SHIFT 6   /* of v_d, to a place in the circle's table */
#define LOOP_CIRCLE_ZERO  256 /* the place for v_d = 0 */

/* The edge of a high side at zero voltage: a quarter of the period, and what the dead time shifts; Q19, and a half to round */
#define LOOP_RISE_Q19 (((LOOP_PWM_COUNTS / 4 + LOOP_DEAD_COUNTS / 2) << 19) + (1 << 18))

/* Half a dead time, Q19, for each 1/128 of share */
#define LOOP_DEAD_Q12 (LOOP_DEAD_COUNTS * 2048)

#endif

/* SPDX-License-Identifier: MIT */
/*
 * The kernels' factors and shifts as plain numbers, shared with assembly versions of the kernels. The headers that use them
 * explain meaning and accuracy.
 */
#ifndef LIB_FACTORS_H
#define LIB_FACTORS_H

/* transform_q15.h: 2/sqrt(3) - 1 in Q17; sin 60 degrees in Q15, and in Q13 for currents, which are larger than voltages */
#define CLARKE_FACTOR_Q17 20277
#define CLARKE_SHIFT      17
#define SIN60_Q15         28378
#define SIN60_Q13         7094

/* pi.h: fraction of gain and integral; from the step's fraction to the integral's */
#define PI_SHIFT      9
#define PI_STEP_SHIFT 6

/* pll.h: gains of the observer for 20 kHz */
#define PLL_KP_SHIFT 3
#define PLL_KI_SHIFT 8

/* deadtime.h: from a current to its share */
#define DEADTIME_SHIFT 2

#endif

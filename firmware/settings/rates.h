/* SPDX-License-Identifier: MIT */
/*
 * The PWM rate, dead time, shortest pulse, settling time of a shunt's amplifier and everything derived from them and the
 * fabric's clock, as plain numbers for C and assembly. Change the first four here or pass them to make (PWM_HZ=40000
 * DEAD_TIME_NS=500 MIN_PULSE_NS=100 SETTLE_NS=600): the rest follows, or config.h stops the compiler and says why.
 */
#ifndef FIRMWARE_SETTINGS_RATES_H
#define FIRMWARE_SETTINGS_RATES_H

#include "drivers/fabric/offsets.h"

#ifndef CONFIG_PWM_HZ
#define CONFIG_PWM_HZ 20000
#endif
#ifndef CONFIG_DEAD_TIME_NS
#define CONFIG_DEAD_TIME_NS 1000
#endif
#ifndef CONFIG_MIN_PULSE_NS
#define CONFIG_MIN_PULSE_NS 20
#endif
#ifndef CONFIG_SETTLE_NS
#define CONFIG_SETTLE_NS 1200
#endif

/*
 * PWM, sampling and current loop are synchronous: one sample each period, or two by the parameter pwm_samples, up to the
 * highest tested loop rate. Times are rounded up to whole counts.
 */
#define CONFIG_HALF_COUNTS      (FABRIC_HZ / (2 * CONFIG_PWM_HZ))
#define CONFIG_PWM_COUNTS       (2 * CONFIG_HALF_COUNTS)
#define CONFIG_DEAD_COUNTS      ((FABRIC_HZ / 1000000 * CONFIG_DEAD_TIME_NS + 999) / 1000)
#define CONFIG_MIN_PULSE_COUNTS ((FABRIC_HZ / 1000000 * CONFIG_MIN_PULSE_NS + 999) / 1000)

/*
 * How long a low side must have been on for its shunt to tell the current. A current out of the bridge goes through the diode
 * before, during the dead time; one into it does not, but the compensation of the dead time keeps its low side on for longer by
 * as much. So of the amplifier's settling time the dead time has gone by already.
 */
#define CONFIG_SETTLE_AFTER_NS (CONFIG_SETTLE_NS - CONFIG_DEAD_TIME_NS)
#define CONFIG_SETTLE_COUNTS \
    (CONFIG_SETTLE_AFTER_NS > 10 ? (FABRIC_HZ / 1000000 * CONFIG_SETTLE_AFTER_NS + 999) / 1000 : 1)

#define CONFIG_LOOP_HZ_MAX 40000

/* state machine, speed loop and supervision */
#define CONFIG_SLOW_HZ          1000
#define CONFIG_PERIODS_PER_SLOW (CONFIG_PWM_HZ / CONFIG_SLOW_HZ)

/*
 * The electrical frequency for 1.0 in w_q15: 1/16 turn a PWM period, because w_q15 is the observer's Q32 speed shifted by 13,
 * or by 12 with two samples a period.
 */
#define CONFIG_SPEED_BASE_HZ (CONFIG_PWM_HZ / 16)
#define CONFIG_W_SHIFT       13u

/*
 * Radius of the voltage circle, in counts of half the on-time: a phase reaches Vbus/sqrt(3) with space vectors, and each half
 * period loses two dead times: each side's shortest pulse must fit in addition to the dead times and their compensation. Four
 * counts are kept for rounding.
 */
#define CONFIG_RADIUS(steps) \
    ((CONFIG_PWM_COUNTS - 4 * CONFIG_DEAD_COUNTS - 2 * CONFIG_MIN_PULSE_COUNTS - 4) * (steps) / 2 * 18919 / 32768)

/*
 * The loop's voltages are in steps of 2^-CONFIG_V_SHIFT counts of half the on-time: the finest that keeps the radius within 16
 * bits, so it is above half of that. The observer's gains keep its double pole near 1250 rad/s (lib/pll.h): 2^-(kp + 1) a
 * sample; near 2500 rad/s with two samples a period, because the handler is the same.
 */
#if CONFIG_RADIUS(32) <= 32766
#define CONFIG_V_SHIFT 5
#elif CONFIG_RADIUS(16) <= 32766
#define CONFIG_V_SHIFT 4
#else
#define CONFIG_V_SHIFT 3
#endif

#if CONFIG_PWM_HZ > 28000
#define CONFIG_PLL_KP_SHIFT 4
#elif CONFIG_PWM_HZ > 14000
#define CONFIG_PLL_KP_SHIFT 3
#else
#define CONFIG_PLL_KP_SHIFT 2
#endif
#define CONFIG_PLL_KI_SHIFT (2 * CONFIG_PLL_KP_SHIFT + 2)

#define CONFIG_RADIUS_STEPS CONFIG_RADIUS(1 << CONFIG_V_SHIFT)

/* The whole bus in those steps. */
#define CONFIG_BUS_STEPS (CONFIG_PWM_COUNTS << (CONFIG_V_SHIFT - 1))

/* The largest fundamental of a phase, in six steps: 2 / pi of the bus. */
#define CONFIG_SIX_STEPS (CONFIG_BUS_STEPS / 1000 * 63662 / 100)

#endif

/* SPDX-License-Identifier: MIT */
/* The drive's fixed choices. Everything a user may want to change at run time is in params.h instead. */
#ifndef FIRMWARE_SETTINGS_CONFIG_H
#define FIRMWARE_SETTINGS_CONFIG_H

#include "drivers/board.h"

#define CONFIG_VERSION "0.1.0"

/* PWM, sampling and current loop run in step */
#define CONFIG_PWM_HZ       20000u
#define CONFIG_PWM_COUNTS   (BOARD_FABRIC_HZ / CONFIG_PWM_HZ)
#define CONFIG_DEAD_TIME_NS 1000u
#define CONFIG_DEAD_COUNTS  (BOARD_FABRIC_HZ / 1000000u * CONFIG_DEAD_TIME_NS / 1000u)

/* state machine, speed loop and supervision */
#define CONFIG_SLOW_HZ        1000u
#define CONFIG_LOOPS_PER_SLOW (CONFIG_PWM_HZ / CONFIG_SLOW_HZ)

/* interrupt priorities: 0 is the most urgent of 16 */
#define CONFIG_PRIORITY_CURRENT_LOOP 0u
#define CONFIG_PRIORITY_SLOW_LOOP    4u
#define CONFIG_PRIORITY_CONSOLE      8u

#define CONFIG_CONSOLE_BAUD 115200u

_Static_assert(BOARD_FABRIC_HZ % CONFIG_PWM_HZ == 0, "the PWM period is a whole number of counts");
_Static_assert(CONFIG_PWM_HZ % CONFIG_SLOW_HZ == 0, "a slow period is a whole number of PWM periods");

#endif

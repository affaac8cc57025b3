/* SPDX-License-Identifier: MIT */
/* The drive's compile-time settings; timing is in rates.h. Settings a user may change at run time are in params.h. */
#ifndef FIRMWARE_SETTINGS_CONFIG_H
#define FIRMWARE_SETTINGS_CONFIG_H

#include "drivers/board.h"
#include "firmware/settings/rates.h"

#define CONFIG_VERSION "0.1.0"

/* interrupt priorities: 0 is the most urgent of 16 */
#define CONFIG_PRIORITY_CURRENT_LOOP 0u
#define CONFIG_PRIORITY_SCOPE        2u
#define CONFIG_PRIORITY_CAN          3u /* a frame may be over in 47 us, drivers/mss/can.h */
#define CONFIG_PRIORITY_SLOW_LOOP    4u
#define CONFIG_PRIORITY_CONSOLE      8u
#define CONFIG_PRIORITY_BUS          8u

#define CONFIG_CONSOLE_BAUD 115200u

/* The fabric's watchdog of the slow loop, while the bridge is on. */
#define CONFIG_WATCH_US     3500u
#define CONFIG_WATCH_CLOCKS (CONFIG_WATCH_US * (BOARD_FABRIC_HZ / 1000000u))
/* Time-out of the thread while the bridge is on: ten times the longest measured (docs/faults.md). */
#define CONFIG_THREAD_MS 100

_Static_assert(FABRIC_HZ % (2 * CONFIG_PWM_HZ) == 0,
               "CONFIG_PWM_HZ: half a PWM period must be a whole number of the fabric's counts");
_Static_assert(CONFIG_PWM_HZ % CONFIG_SLOW_HZ == 0, "CONFIG_PWM_HZ must be a multiple of CONFIG_SLOW_HZ");
_Static_assert(CONFIG_PWM_HZ % 16 == 0,
               "CONFIG_PWM_HZ must be a multiple of 16: CONFIG_SPEED_BASE_HZ is a whole number");
_Static_assert(CONFIG_PWM_HZ >= 8000 && CONFIG_PWM_HZ <= CONFIG_LOOP_HZ_MAX,
               "CONFIG_PWM_HZ: tested from 8000 to 40000");
_Static_assert(CONFIG_SETTLE_COUNTS < 4096, "CONFIG_SETTLE_NS: at most 40 us, the ADC's register");
_Static_assert(FABRIC_HZ % 1000000 == 0,
               "FABRIC_HZ must be a whole number of megahertz: the dead time is counted in them");

#endif

/* SPDX-License-Identifier: MIT */
#ifndef FIRMWARE_SYSTEM_MEASURE_H
#define FIRMWARE_SYSTEM_MEASURE_H

#include <stdint.h>

/*
 * Cycles that one current-loop interrupt takes from the thread, entry and exit included. `time_ms` is a clock that the slow
 * loop advances. Thread; busy for two PWM periods, or a few times that if the slow loop comes in between.
 */
uint32_t measure_current_loop_cycles(const volatile uint32_t *time_ms);

#endif

/* SPDX-License-Identifier: MIT */
/* The cycle counter's unit as it is, but for the counter: time passes as a test wants it. */
#ifndef TESTS_UNIT_HOST_DWT_H
#define TESTS_UNIT_HOST_DWT_H

#define dwt_cycles dwt_cycles_of_the_core
#include_next "drivers/cortex/dwt.h"
#undef dwt_cycles

uint32_t dwt_cycles(void);

#endif

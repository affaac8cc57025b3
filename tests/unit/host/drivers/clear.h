/* SPDX-License-Identifier: MIT */
/* Memory in place of registers: what is cleared goes. */
#ifndef TESTS_UNIT_HOST_CLEAR_H
#define TESTS_UNIT_HOST_CLEAR_H

#include <stdint.h>

static inline void reg_clear(volatile uint32_t *status, uint32_t bits)
{
    *status &= ~bits;
}

#endif

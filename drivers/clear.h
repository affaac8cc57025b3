/* SPDX-License-Identifier: MIT */
/*
 * Status bits that are cleared by writing 1 to them. Memory does not behave this way: unit tests, where it stands for
 * registers, have their own header instead.
 */
#ifndef DRIVERS_CLEAR_H
#define DRIVERS_CLEAR_H

#include <stdint.h>

static inline void reg_clear(volatile uint32_t *status, uint32_t bits)
{
    *status = bits;
}

#endif

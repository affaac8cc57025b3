/* SPDX-License-Identifier: MIT */
/*
 * Every register access that eNVM programming makes. Tests count them, cut the power after any of them, and put a model of the
 * controller in place of the registers. Nothing but the access: this runs from eSRAM.
 */
#ifndef DRIVERS_MSS_ENVM_BUS_H
#define DRIVERS_MSS_ENVM_BUS_H

#include <stdint.h>

static inline __attribute__((always_inline)) uint32_t envm_bus_read(const volatile uint32_t *reg)
{
    return *reg;
}

static inline __attribute__((always_inline)) void envm_bus_write(volatile uint32_t *reg, uint32_t value)
{
    *reg = value;
}

#endif

/* SPDX-License-Identifier: MIT */
/* In place of registers, a model of the controller: tests/unit/host/envm.c. */
#ifndef TESTS_UNIT_HOST_ENVM_BUS_H
#define TESTS_UNIT_HOST_ENVM_BUS_H

#include <stdint.h>

uint32_t host_envm_read(uintptr_t address);
void host_envm_write(uintptr_t address, uint32_t value);

static inline uint32_t envm_bus_read(const volatile uint32_t *reg)
{
    return host_envm_read((uintptr_t)reg);
}

static inline void envm_bus_write(volatile uint32_t *reg, uint32_t value)
{
    host_envm_write((uintptr_t)reg, value);
}

#endif

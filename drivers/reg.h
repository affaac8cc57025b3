/* SPDX-License-Identifier: MIT */
/*
 * How registers are described: a block is a struct of volatile fields at a fixed address, and the compiler checks every
 * field against the offset in the manual.
 *
 *     struct foo_regs { volatile uint32_t CONTROL, STATUS; };
 *     REG_AT_OFFSET(struct foo_regs, CONTROL, 0x00);
 *     REG_AT_OFFSET(struct foo_regs, STATUS, 0x04);
 *     #define FOO REG_BLOCK(struct foo_regs, 0x40000000u)
 */
#ifndef DRIVERS_REG_H
#define DRIVERS_REG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define REG_AT_OFFSET(type, field, offset) _Static_assert(offsetof(type, field) == (offset), #field " at " #offset)
#define REG_BLOCK(type, address)           ((type *)(uintptr_t)(address))

#endif

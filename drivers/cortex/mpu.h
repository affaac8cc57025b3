/* SPDX-License-Identifier: MIT */
/*
 * Memory protection unit, used for one thing: a stack overflow faults instead of overwriting its neighbour.
 * ARMv7-M ARM, B3.5.
 */
#ifndef DRIVERS_CORTEX_MPU_H
#define DRIVERS_CORTEX_MPU_H

#include "drivers/cortex/cpu.h"
#include "drivers/reg.h"

struct mpu_regs {
    volatile uint32_t TYPE;
    volatile uint32_t CTRL;
    volatile uint32_t RNR;
    volatile uint32_t RBAR;
    volatile uint32_t RASR;
};

REG_AT_OFFSET(struct mpu_regs, TYPE, 0x00);
REG_AT_OFFSET(struct mpu_regs, CTRL, 0x04);
REG_AT_OFFSET(struct mpu_regs, RNR, 0x08);
REG_AT_OFFSET(struct mpu_regs, RBAR, 0x0C);
REG_AT_OFFSET(struct mpu_regs, RASR, 0x10);

#define MPU REG_BLOCK(struct mpu_regs, 0xE000ED90u)

#define MPU_TYPE_DREGION    (0xFFu << 8)
#define MPU_CTRL_ENABLE     (1u << 0)
#define MPU_CTRL_PRIVDEFENA (1u << 2)
#define MPU_RBAR_ADDR       0xFFFFFFE0u
#define MPU_RASR_ENABLE     (1u << 0)
#define MPU_RASR_SIZE_SHIFT 1u
#define MPU_RASR_AP_NONE    (0u << 24)
#define MPU_RASR_XN         (1u << 28)
#define MPU_GUARD_REGION    7u /* the highest number wins where regions overlap */

static inline uint32_t mpu_guard_rasr(uint32_t size)
{
    const uint32_t log2_size = 31u - (uint32_t)__builtin_clz(size);
    return MPU_RASR_XN | MPU_RASR_AP_NONE | ((log2_size - 1u) << MPU_RASR_SIZE_SHIFT) | MPU_RASR_ENABLE;
}

/*
 * Forbids every access to [base, base + size) and leaves the default memory map everywhere else. HardFault and NMI are
 * exempt (HFNMIENA 0), so that they can run whatever the stack pointer.
 *
 * size: a power of two, 32 ... 2^31 bytes; base: a multiple of it. Returns false and changes nothing if that does not
 * hold or the device has its MPU switched off (SYSREG M3_CR b28). Context: thread.
 */
static inline bool mpu_guard_stack(uint32_t base, uint32_t size)
{
    const bool describable = size >= 32u && (size & (size - 1u)) == 0u && (base & (size - 1u)) == 0u;
    if (!describable || (MPU->TYPE & MPU_TYPE_DREGION) == 0u) {
        return false;
    }
    MPU->CTRL = 0u;
    MPU->RNR = MPU_GUARD_REGION;
    MPU->RBAR = base;
    MPU->RASR = mpu_guard_rasr(size);
    MPU->CTRL = MPU_CTRL_PRIVDEFENA | MPU_CTRL_ENABLE;
    cpu_dsb();
    cpu_isb();
    return true;
}

/* Whether mpu_guard_stack() with these arguments is in effect, read back from the unit. Context: thread. */
static inline bool mpu_guards(uint32_t base, uint32_t size)
{
    if ((MPU->CTRL & MPU_CTRL_ENABLE) == 0u) {
        return false;
    }
    MPU->RNR = MPU_GUARD_REGION;
    return (MPU->RBAR & MPU_RBAR_ADDR) == base && MPU->RASR == mpu_guard_rasr(size);
}

#endif

/* SPDX-License-Identifier: MIT */
/*
 * System control block: exceptions of the core, faults, reset. ARMv7-M ARM, B3.2.
 */
#ifndef DRIVERS_CORTEX_SCB_H
#define DRIVERS_CORTEX_SCB_H

#include "drivers/cortex/cpu.h"
#include "drivers/mss/irq.h"
#include "drivers/reg.h"

struct scb_regs {
    volatile uint32_t CPUID;
    volatile uint32_t ICSR;
    volatile uint32_t VTOR;
    volatile uint32_t AIRCR;
    volatile uint32_t SCR;
    volatile uint32_t CCR;
    volatile uint8_t SHPR[12]; /* priorities of exceptions 4...15 */
    volatile uint32_t SHCSR;
    volatile uint32_t CFSR;
    volatile uint32_t HFSR;
    volatile uint32_t DFSR;
    volatile uint32_t MMFAR;
    volatile uint32_t BFAR;
    volatile uint32_t AFSR;
};

REG_AT_OFFSET(struct scb_regs, CPUID, 0x00);
REG_AT_OFFSET(struct scb_regs, ICSR, 0x04);
REG_AT_OFFSET(struct scb_regs, VTOR, 0x08);
REG_AT_OFFSET(struct scb_regs, AIRCR, 0x0C);
REG_AT_OFFSET(struct scb_regs, SCR, 0x10);
REG_AT_OFFSET(struct scb_regs, CCR, 0x14);
REG_AT_OFFSET(struct scb_regs, SHPR, 0x18);
REG_AT_OFFSET(struct scb_regs, SHCSR, 0x24);
REG_AT_OFFSET(struct scb_regs, CFSR, 0x28);
REG_AT_OFFSET(struct scb_regs, HFSR, 0x2C);
REG_AT_OFFSET(struct scb_regs, DFSR, 0x30);
REG_AT_OFFSET(struct scb_regs, MMFAR, 0x34);
REG_AT_OFFSET(struct scb_regs, BFAR, 0x38);
REG_AT_OFFSET(struct scb_regs, AFSR, 0x3C);

#define SCB REG_BLOCK(struct scb_regs, 0xE000ED00u)

#define SCB_ICSR_PENDSVSET    (1u << 28)
#define SCB_AIRCR_VECTKEY     (0x05FAu << 16)
#define SCB_AIRCR_PRIGROUP    (7u << 8)
#define SCB_AIRCR_SYSRESETREQ (1u << 2)
#define SCB_CCR_DIV_0_TRP     (1u << 4)
#define SCB_CCR_STKALIGN      (1u << 9)
#define SCB_SHCSR_MEMFAULTENA (1u << 16)
#define SCB_SHCSR_BUSFAULTENA (1u << 17)
#define SCB_SHCSR_USGFAULTENA (1u << 18)

/* CFSR: memory management (0...7), bus (8...15) and usage faults (16...31); the ones worth a name. B3.2.15. */
#define SCB_CFSR_IACCVIOL    (1u << 0)
#define SCB_CFSR_DACCVIOL    (1u << 1)
#define SCB_CFSR_MSTKERR     (1u << 4)
#define SCB_CFSR_MMARVALID   (1u << 7)
#define SCB_CFSR_IBUSERR     (1u << 8)
#define SCB_CFSR_PRECISERR   (1u << 9)
#define SCB_CFSR_IMPRECISERR (1u << 10)
#define SCB_CFSR_STKERR      (1u << 12)
#define SCB_CFSR_BFARVALID   (1u << 15)
#define SCB_CFSR_UNDEFINSTR  (1u << 16)
#define SCB_CFSR_INVSTATE    (1u << 17)
#define SCB_CFSR_DIVBYZERO   (1u << 25)

enum scb_exception {
    SCB_EXCEPTION_MEMMANAGE = 4,
    SCB_EXCEPTION_BUSFAULT = 5,
    SCB_EXCEPTION_USAGEFAULT = 6,
    SCB_EXCEPTION_SVCALL = 11,
    SCB_EXCEPTION_DEBUGMON = 12,
    SCB_EXCEPTION_PENDSV = 14,
    SCB_EXCEPTION_SYSTICK = 15,
};

/* level 0 (most urgent) ... 15; larger values are taken as 15. Context: any. */
static inline void scb_priority(enum scb_exception exception, uint32_t level)
{
    const uint32_t held = level > MSS_IRQ_PRIORITY_LOWEST ? MSS_IRQ_PRIORITY_LOWEST : level;
    SCB->SHPR[(uint32_t)exception - 4u] = (uint8_t)(held << MSS_IRQ_PRIORITY_SHIFT);
}

/* Asks for PendSV, the usual way to leave an ISR's slow part to a lower priority. Context: any; one store. */
static inline void scb_pend_pendsv(void)
{
    SCB->ICSR = SCB_ICSR_PENDSVSET;
}

/*
 * Gives memory-management, bus and usage faults their own handlers (otherwise all are HardFault), and makes a division
 * by zero a usage fault instead of a silent 0.
 */
static inline void scb_enable_faults(void)
{
    SCB->CCR |= SCB_CCR_DIV_0_TRP;
    SCB->SHCSR |= SCB_SHCSR_MEMFAULTENA | SCB_SHCSR_BUSFAULTENA | SCB_SHCSR_USGFAULTENA;
    cpu_dsb();
    cpu_isb();
}

/* What the core knows about a fault. MMFAR and BFAR mean something only with MMARVALID and BFARVALID in CFSR. */
struct scb_fault_status {
    uint32_t cfsr, hfsr, mmfar, bfar;
};

/* Reads and clears the fault status, so the next fault does not show this one's bits. Context: fault. */
static inline struct scb_fault_status scb_take_fault_status(void)
{
    /* The address registers are held only while their valid bits are set: read them before clearing. */
    const struct scb_fault_status status = {
        .cfsr = SCB->CFSR,
        .hfsr = SCB->HFSR,
        .mmfar = SCB->MMFAR,
        .bfar = SCB->BFAR,
    };
    SCB->CFSR = status.cfsr;
    SCB->HFSR = status.hfsr;
    return status;
}

/*
 * Resets the MSS; the cause read afterwards is SYSREG_CAUSE_SOFT. Whether the fabric is reset with it is up to the
 * design (MSS_RESET_N_M2F): switch the bridge off first. Does not return. Context: any.
 */
static inline _Noreturn void scb_system_reset(void)
{
    cpu_dsb();
    SCB->AIRCR = SCB_AIRCR_VECTKEY | (SCB->AIRCR & SCB_AIRCR_PRIGROUP) | SCB_AIRCR_SYSRESETREQ;
    cpu_dsb();
    for (;;) {
        /* the request takes a few cycles */
    }
}

#endif

/* SPDX-License-Identifier: MIT */
/*
 * Gate-driver enable and protection latches in fabric slot 3. Registers: docs/fabric.md, slot 3.
 *
 * This is the switch of the bridge: while LIVE is 0 all six gate signals are low, whatever CorePWM does.
 */
#ifndef DRIVERS_FABRIC_GATE_H
#define DRIVERS_FABRIC_GATE_H

#include "drivers/board.h"
#include "drivers/clear.h"
#include "drivers/reg.h"

struct gate_regs {
    volatile uint32_t CONTROL;
    volatile uint32_t STATUS;
    const volatile uint32_t ID;
};

REG_AT_OFFSET(struct gate_regs, CONTROL, 0x00);
REG_AT_OFFSET(struct gate_regs, STATUS, 0x04);
REG_AT_OFFSET(struct gate_regs, ID, 0x08);

#define GATE_CONTROL_ENABLE (1u << 0)

#define GATE_STATUS_LIVE         (1u << 0)
#define GATE_STATUS_OVERCURRENT  (1u << 1) /* latch: a comparator of the power stage */
#define GATE_STATUS_DRIVER_FAULT (1u << 2) /* latch: fault pin of the gate driver */
#define GATE_STATUS_LOOP_LOST    (1u << 3) /* latch: an ADC overrun while live */
#define GATE_STATUS_INTERLOCK    (1u << 4) /* latch: both sides of a phase commanded on */
#define GATE_STATUS_LATCHES \
    (GATE_STATUS_OVERCURRENT | GATE_STATUS_DRIVER_FAULT | GATE_STATUS_LOOP_LOST | GATE_STATUS_INTERLOCK)
#define GATE_STATUS_ENCODER          (1u << 5) /* as it is now: ENC.STATUS has ILLEGAL or SIGNAL_LOST */
#define GATE_STATUS_OVERRUN          (1u << 6) /* as it is now: ADC.STATUS has OVERRUN */
#define GATE_STATUS_LIMIT            (1u << 7) /* as it is now: ADC.STATUS has a flag of its limits */
#define GATE_STATUS_OVERCURRENT_NOW  (1u << 8)
#define GATE_STATUS_DRIVER_FAULT_NOW (1u << 9)

#define GATE_ID 0x464F4321u /* "FOC", version 2.1 of the fabric contract */

/*
 * True if the fabric holds the design this firmware was written for. Read it before anything else in the fabric: with
 * an unprogrammed fabric this read is a bus fault or never ends (the watchdog ends that). Context: thread.
 */
static inline bool gate_id_ok(const struct gate_regs *gate)
{
    return gate->ID == GATE_ID;
}

/*
 * Lets the gate signals follow CorePWM. Returns whether they do now: false while a latch is set (see gate_status()).
 * Context: any.
 */
static inline bool gate_enable(struct gate_regs *gate)
{
    gate->CONTROL = GATE_CONTROL_ENABLE;
    return (gate->STATUS & GATE_STATUS_LIVE) != 0u;
}

/* All six gate signals low. One store, needs no state and no stack: the first act of every fault. Context: any. */
static inline __attribute__((always_inline)) void gate_disable(struct gate_regs *gate)
{
    gate->CONTROL = 0u;
}

/* GATE_STATUS_* bits: all that can be wrong in the fabric, in one word. Context: any. */
static inline uint32_t gate_status(const struct gate_regs *gate)
{
    return gate->STATUS;
}

/*
 * Clears the given latches and returns those of them that stay set because their input is not quiet (0: all clear).
 * Does not enable anything. Context: any.
 */
static inline uint32_t gate_clear(struct gate_regs *gate, uint32_t latches)
{
    reg_clear(&gate->STATUS, latches & GATE_STATUS_LATCHES);
    return gate->STATUS & latches & GATE_STATUS_LATCHES;
}

#endif

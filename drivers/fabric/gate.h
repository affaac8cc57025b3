/* SPDX-License-Identifier: MIT */
/*
 * Gate-driver enable, protection latches and brake chopper in fabric slot 3. Registers: docs/fabric.md, slot 3.
 *
 * This is the switch of the bridge: while LIVE is 0 all six gate signals are low, whatever the PWM does.
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
    volatile uint32_t CHOPPER;
    volatile uint32_t CHOPPER_ON;
    volatile uint32_t CHOPPER_OFF;
    const volatile uint32_t AXES;
    volatile uint32_t WATCH_TIME;
    const volatile uint32_t WATCH;
    volatile uint32_t PROOF;
};

#define GATE_CONTROL_ENABLE (1u << 0)

#define GATE_STATUS_LIVE             (1u << 0)
#define GATE_STATUS_OVERCURRENT      (1u << 1) /* latch: a comparator of the power stage */
#define GATE_STATUS_DRIVER_FAULT     (1u << 2) /* latch: fault pin of the gate driver */
#define GATE_STATUS_LOOP_LOST        (1u << 3) /* latch: an ADC overrun while live */
#define GATE_STATUS_INTERLOCK        (1u << 4) /* latch: both sides of a phase commanded on */
#define GATE_STATUS_ENCODER          (1u << 5) /* live: ENC.STATUS has ILLEGAL or SIGNAL_LOST */
#define GATE_STATUS_OVERRUN          (1u << 6) /* live: ADC.STATUS has OVERRUN */
#define GATE_STATUS_LIMIT            (1u << 7) /* live: ADC.STATUS has a limit flag */
#define GATE_STATUS_OVERCURRENT_NOW  (1u << 8)
#define GATE_STATUS_DRIVER_FAULT_NOW (1u << 9)
#define GATE_STATUS_STO_A            (1u << 10) /* latch: first input of safe torque off */
#define GATE_STATUS_STO_B            (1u << 11) /* latch: second input */
#define GATE_STATUS_CLOCK_LOST       (1u << 12) /* latch: the PLL of the fabric's clock lost its lock */
#define GATE_STATUS_STO_A_NOW        (1u << 13)
#define GATE_STATUS_STO_B_NOW        (1u << 14)
#define GATE_STATUS_SLOW_LOST        (1u << 15) /* latch: the slow loop's proof of life was late or wrong */
#define GATE_STATUS_THREAD_LOST      (1u << 16) /* latch: the thread's */
#define GATE_STATUS_STO_APART        (1u << 17) /* latch: one input of safe torque off asked alone for too long */
#define GATE_STATUS_LATCHES \
    (GATE_STATUS_OVERCURRENT | GATE_STATUS_DRIVER_FAULT | GATE_STATUS_LOOP_LOST | GATE_STATUS_INTERLOCK | \
     GATE_STATUS_STO_A | GATE_STATUS_STO_B | GATE_STATUS_STO_APART | GATE_STATUS_CLOCK_LOST | GATE_STATUS_SLOW_LOST | \
     GATE_STATUS_THREAD_LOST)

#define GATE_CHOPPER_ENABLE   (1u << 0)
#define GATE_CHOPPER_CHOPPING (1u << 1)

#define GATE_WATCH_TIME_CLOCKS 0xFFFFFu
#define GATE_WATCH_THREAD      (1u << 8) /* the thread's turn; 0: the slow loop's */
#define GATE_WATCH_NUMBER      0xFFu
#define GATE_PROOF_SLOW        0x5A17C300u
#define GATE_PROOF_THREAD      0xA5E83C00u

#define GATE_ID 0x464F4332u /* "FOC", version 3.2 of the fabric contract */

/*
 * True if the fabric holds the design this firmware was written for. Read it before anything else in the fabric: with
 * an unprogrammed fabric this read is a bus fault or never ends (the watchdog ends that). Context: thread.
 */
static inline bool gate_id_ok(const struct gate_regs *gate)
{
    return gate->ID == GATE_ID;
}

/* How many axes the design has. Context: thread, behind gate_id_ok(). */
static inline uint32_t gate_axes(const struct gate_regs *gate)
{
    return (gate->AXES >> 4) & 15u;
}

/*
 * Lets the gate signals follow the PWM. Returns whether they do now: false while a latch is set (see gate_status()).
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

/*
 * Sets the brake chopper: its resistor loads the bus from `on_q15` up, until the bus is down to `off_q15`, both Q15 of the
 * voltage range, 0 ... 32767. The fabric does it by itself, bridge on or off, as long as the ADC converts. Thresholds without
 * a gap, or none (0), switch it off for good. Context: thread.
 */
static inline void gate_set_chopper(struct gate_regs *gate, int32_t on_q15, int32_t off_q15)
{
    gate->CHOPPER = 0u;
    if (off_q15 <= 0 || off_q15 >= on_q15) {
        return;
    }
    gate->CHOPPER_ON = (uint32_t)on_q15;
    gate->CHOPPER_OFF = (uint32_t)off_q15;
    gate->CHOPPER = GATE_CHOPPER_ENABLE;
}

/*
 * Starts the watch over the program, until a reset: from now on live gates need both proofs of a round each so many clocks, and
 * compares in each PWM period. Returns whether it runs with this time. Bridge off. Context: thread.
 */
static inline bool gate_start_watch(struct gate_regs *gate, uint32_t clocks)
{
    gate->WATCH_TIME = clocks;
    return (gate->WATCH_TIME & GATE_WATCH_TIME_CLOCKS) == clocks; /* 0 until it is started */
}

/*
 * A round of proofs: the slow loop lives. The second word, which the fabric leaves to the thread, is the slow loop's, too: it
 * watches the thread itself. Behind it the turn is the first word's, so that a latch names the slow loop. Context: slow loop.
 */
static inline void gate_prove(struct gate_regs *gate)
{
    const uint32_t next = gate->WATCH;
    if ((next & GATE_WATCH_THREAD) == 0u) {
        gate->PROOF = GATE_PROOF_SLOW | (next & GATE_WATCH_NUMBER);
    }
    gate->PROOF = GATE_PROOF_THREAD | (next & GATE_WATCH_NUMBER);
}

#endif

/* SPDX-License-Identifier: MIT */
/*
 * Incremental encoder counter and Hall switches in fabric slot 2. Registers: docs/fabric.md, slot 2.
 *
 * The counter starts at 0 wherever the rotor stands. Only the index is absolute.
 */
#ifndef DRIVERS_FABRIC_ENCODER_H
#define DRIVERS_FABRIC_ENCODER_H

#include "drivers/board.h"
#include "drivers/clear.h"
#include "drivers/reg.h"

struct encoder_regs {
    volatile uint32_t CONTROL;
    volatile uint32_t COUNTS;
    const volatile uint32_t POSITION;
    const volatile uint32_t LATCHED;
    const volatile uint32_t INDEX;
    volatile uint32_t STATUS;
    const volatile uint32_t EDGE_TIME;
    const volatile uint32_t LATCH_TIME;
    volatile uint32_t FILTER;
    const volatile uint32_t HALL;
    const volatile uint32_t HALL_TIME;
};

#define ENCODER_CONTROL_ENABLE     (1u << 0)
#define ENCODER_CONTROL_REVERSE    (1u << 1)
#define ENCODER_STATUS_INDEX_SEEN  (1u << 0)
#define ENCODER_STATUS_ILLEGAL     (1u << 1)
#define ENCODER_STATUS_SIGNAL_LOST (1u << 2)

#define ENCODER_HALL_LATCHED 0x7u
#define ENCODER_FILTER_HALL  0xFF00u

#define ENCODER_COUNTS_MIN 4u
#define ENCODER_COUNTS_MAX 65536u

/*
 * Starts counting from 0 with `counts` edges per revolution (4 times the lines), ENCODER_COUNTS_MIN ... _MAX; reverse:
 * count down when A leads B. Clears the status. Returns false, with the counter stopped, if counts is out of range or
 * does not read back. Context: thread.
 */
bool encoder_init(struct encoder_regs *encoder, uint32_t counts, bool reverse);

/* Position at the last ADC trigger, 0 ... counts-1: of the same instant as the currents. Context: any. */
static inline uint32_t encoder_latched(const struct encoder_regs *encoder)
{
    return encoder->LATCHED;
}

/*
 * Fabric clocks of 10 ns, modulo 2^32: at the last edge counted before the last ADC trigger, and at that trigger. Only
 * differences are meaningful. Context: any.
 */
static inline uint32_t encoder_edge_clock(const struct encoder_regs *encoder)
{
    return encoder->EDGE_TIME;
}

static inline uint32_t encoder_latch_clock(const struct encoder_regs *encoder)
{
    return encoder->LATCH_TIME;
}

/*
 * The Hall switches at the last ADC trigger, C B A in bits 2 to 0, and when they last changed, by the clock above.
 * Context: any.
 */
static inline uint32_t encoder_hall_latched(const struct encoder_regs *encoder)
{
    return encoder->HALL & ENCODER_HALL_LATCHED;
}

static inline uint32_t encoder_hall_clock(const struct encoder_regs *encoder)
{
    return encoder->HALL_TIME;
}

/* Sets how many steps of 16 fabric clocks a Hall switch must keep a new state to count, 0 ... 255. Context: thread. */
static inline void encoder_filter_hall(struct encoder_regs *encoder, uint32_t steps)
{
    encoder->FILTER = (encoder->FILTER & ~ENCODER_FILTER_HALL) | (steps << 8 & ENCODER_FILTER_HALL);
}

/* Position now, 0 ... counts-1. Context: any. */
static inline uint32_t encoder_position(const struct encoder_regs *encoder)
{
    return encoder->POSITION;
}

/* Position at the last rising edge of the index; valid once ENCODER_STATUS_INDEX_SEEN is set. Context: any. */
static inline uint32_t encoder_index(const struct encoder_regs *encoder)
{
    return encoder->INDEX;
}

/* ENCODER_STATUS_* bits. Context: any. */
static inline uint32_t encoder_status(const struct encoder_regs *encoder)
{
    return encoder->STATUS;
}

/* Clears the given status bits; SIGNAL_LOST stays while the signal is missing. Context: any. */
static inline void encoder_clear(struct encoder_regs *encoder, uint32_t status_bits)
{
    reg_clear(&encoder->STATUS, status_bits);
}

#endif

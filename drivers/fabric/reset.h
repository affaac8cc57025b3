/* SPDX-License-Identifier: MIT */
/* The fabric of an axis as a reset leaves it, whatever was there before. Reset values: docs/fabric.md. */
#ifndef DRIVERS_FABRIC_RESET_H
#define DRIVERS_FABRIC_RESET_H

#include "drivers/fabric/fabric.h"

#define RESET_NO_LIMIT  0x1FFFFu
#define RESET_MODULATOR 0x511u
#define RESET_CHOPPER   0x7FFFu

/*
 * Bridge and chopper off, latches cleared; ADC and filters of the inputs as a reset leaves them. Encoder and PWM follow with
 * encoder_init() and pwm_init(), which write every register of theirs. What no register shows goes on: counts of conversions
 * and of clocks, what is in a filter. Context: thread.
 */
void fabric_reset(struct fabric *fabric);

#endif

/* SPDX-License-Identifier: MIT */
/*
 * The slow loop: MSS timer 1, once a millisecond. Its clock comes from the same PLL as the PWM, so the two never drift. It runs
 * the state machine and the speed loop, and sees when the current loop falls silent.
 */
#ifndef FIRMWARE_SLOW_LOOP_H
#define FIRMWARE_SLOW_LOOP_H

/* Starts the timer and its interrupt. Thread, once, after drive_start(). */
void slow_loop_start(void);

#endif

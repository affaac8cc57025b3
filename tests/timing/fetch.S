/* SPDX-License-Identifier: MIT */
/*
 * Fetch from eNVM with the cache off and 2 wait states: a word of code every 3 cycles. `drain` lets the core use up what
 * the fetch unit had in its buffer, so that from there on it waits for every word.
 */
#include "tests/timing/sequence.inc"

    .macro drain
    .rept 16
    mov.w r2, #0
    .endr
    .endm

    table

    sequence empty, 6, "the frame: two words of code"
    drain
    start
    stop

    sequence narrow, 60, "40 instructions of 16 bits: 20 words"
    drain
    start
    .rept 40
    movs r2, #0
    .endr
    stop

    sequence wide, 120, "40 instructions of 32 bits: 40 words"
    drain
    start
    .rept 40
    mov.w r2, #0
    .endr
    stop

    end_of_table

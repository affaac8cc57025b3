/* SPDX-License-Identifier: MIT */
/*
 * Code in eSRAM with a register in its read path: over the system bus the core asks for a word every other cycle at most, so
 * that a word comes every 2 + 1 cycles, and not while data are on that bus.
 */
#include "tests/timing/sequence.inc"

    .macro drain
    .rept 16
    mov.w r2, #0
    .endr
    .endm

    table

    sequence empty, 6, "the frame: two words of code", .ramcode.timing
    drain
    start
    stop

    sequence narrow, 60, "40 instructions of 16 bits: 20 words", .ramcode.timing
    drain
    start
    .rept 40
    movs r2, #0
    .endr
    stop

    sequence wide, 120, "40 instructions of 32 bits: 40 words", .ramcode.timing
    drain
    start
    .rept 40
    mov.w r2, #0
    .endr
    stop

    sequence data, 70, "10 stores of 32 bits with one between: 20 words and 10 data", .ramcode.timing
    drain
    start
    .rept 10
    str.w r2, [r1]              @ the bus is the store's for its cycle
    mov.w r2, #0
    .endr
    stop

    end_of_table

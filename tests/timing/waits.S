/* SPDX-License-Identifier: MIT */
/*
 * Wait states, counted by hand for: APB read 3, APB write 2, private bus 1, eSRAM 1, and eNVM's cache on. A load waits for
 * its own; the last write of a store is posted, and the next access on the same bus waits for it.
 */
#include "tests/timing/sequence.inc"

    .equ GATE_ID, 0x50000308

    table

    sequence empty, 5, "the frame: NOP NOP LDR"
    start
    stop

    sequence apb_load, 5, "LDR from the fabric"
    ldr r3, =GATE_ID
    start
    ldr r2, [r3]                @ 2 + 3
    stop

    sequence apb_loads, 9, "LDR LDR from the fabric"
    ldr r3, =GATE_ID
    start
    ldr r2, [r3]                @ 2 + 3
    ldr r4, [r3]                @ 1 + 3
    stop

    sequence apb_store, 1, "STR to the fabric"
    ldr r3, =GATE_ID
    start
    str r2, [r3]                @ 1, then 2 in the buffer
    stop

    sequence apb_stores, 7, "STR STR STR to the fabric"
    ldr r3, =GATE_ID
    start
    str r2, [r3]                @ 1
    str r2, [r3]                @ 1 + 2
    str r2, [r3]                @ 1 + 2
    stop

    sequence apb_stores_apart, 4, "STR to the fabric, two others, STR"
    ldr r3, =GATE_ID
    start
    str r2, [r3]                @ 1
    nop                         @ 1
    nop                         @ 1
    str r2, [r3]                @ 1
    stop

    sequence apb_store_load, 9, "STR to the fabric, LDR from it"
    ldr r3, =GATE_ID
    start
    str r2, [r3]                @ 1
    ldr r2, [r3]                @ 2 + 3, 1 after the store, 2 for the buffer
    stop

    sequence apb_store_esram, 7, "STR to the fabric, LDR from eSRAM"
    ldr r3, =GATE_ID
    start
    str r2, [r3]                @ 1
    ldr r2, [r0]                @ 2 + 1, 1 after the store, 2 for the buffer
    stop

    sequence apb_store_literal, 4, "STR to the fabric, LDR of a constant"
    ldr r3, =GATE_ID
    start
    str r2, [r3]                @ 1
    ldr r2, =0x12345678         @ 2, at most 1 after the store; another bus
    stop

    sequence apb_barrier, 7, "STR to the fabric, DSB"
    ldr r3, =GATE_ID
    start
    str r2, [r3]                @ 1
    dsb                         @ at most 4, 2 for the buffer
    stop

    sequence private_load, 3, "LDR from the private bus"
    start
    ldr r4, [r12]               @ 2 + 1
    stop

    sequence esram_loads, 5, "LDR LDR from eSRAM"
    start
    ldr r2, [r0]                @ 2 + 1
    ldr r3, [r1]                @ 1 + 1
    stop

    sequence esram_stores, 2, "STR STR to eSRAM"
    start
    str r2, [r1]                @ 1
    str r3, [r1, #4]            @ 1: the register is in the read path
    stop

    sequence esram_multiple, 9, "LDM of 4 from eSRAM"
    start
    ldm r0, {r2-r5}             @ 1 + 4 * (1 + 1)
    stop

    sequence esram_multiple_store, 5, "STM of 4 to eSRAM"
    start
    stm r1, {r2-r5}             @ 1 + 4
    stop

    sequence esram_double, 9, "LDRD, STRD"
    start
    ldrd r2, r3, [r0]           @ 3 + 2
    nop                         @ 1
    strd r2, r3, [r1]           @ 3
    stop

    end_of_table

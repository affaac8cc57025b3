/* SPDX-License-Identifier: MIT */
/*
 * What C cannot time: instructions by the block, between two looks at CYCCNT. A kernel returns the difference, in which the
 * second look itself has its 2 cycles. Called twice, the second call finds code and data in the cache.
 *
 * Kernels that look at the eNVM run from eSRAM, so that fetches do not take part, and all others the way the drive's code does.
 */
    .syntax unified
    .cpu    cortex-m3
    .thumb

    .equ    CYCCNT, 0xE0001004          /* DWT */
    .equ    ICSR, 0xE000ED04            /* SCB */
    .equ    CFSR, 0xE000ED28
    .equ    PENDSVSET, 0x10000000
    .equ    ACCESSES, 64                /* MEASURE_ACCESSES */
    .equ    FRAME_R2, 8                 /* of an exception frame */
    .equ    FRAME_PC, 24

    .macro  begin name, section
    .section \section, "ax", %progbits
    .balign 4
    .global \name
    .type   \name, %function
    .thumb_func
\name:
    .endm

    .macro  kernel name, section, instruction, second, third
    begin   \name, \section
    ldr     r1, =CYCCNT
    movs    r3, #0
    mov     r12, r3
    ldr     r2, [r1]
    .balign 4
    .rept   ACCESSES
    \instruction
    \second
    \third
    .endr
    ldr     r3, [r1]
    subs    r0, r3, r2
    bx      lr
    .balign 4
    .ltorg
    .size   \name, . - \name
    .endm

    /* Each address is what the load before has found, so that no two loads overlap. */
    kernel  measure_chase, .text.measure, "ldr r0, [r0]"
    kernel  measure_chase_from_esram, .ramcode.measure, "ldr r0, [r0]"
    kernel  measure_stores, .text.measure, "str r3, [r0]"
    kernel  measure_fetches, .ramcode.measure, "mov.w r12, r12"
    kernel  measure_loads, .text.measure, "ldr r3, [r0]", "mov r12, r12"
    kernel  measure_reads_behind_writes, .text.measure, "str.w r12, [r0]", "ldr r3, [r0]", "mov r12, r12"

    /* measure_strides(start, stride, count): a load at every stride. */
    begin   measure_strides, .ramcode.measure
    push    {r4, r5, lr}
    ldr     r3, =CYCCNT
    ldr     r4, [r3]
    .balign 4
stride:
    ldr     r5, [r0]
    adds    r0, r0, r1
    subs    r2, r2, #1
    bne     stride
    ldr     r5, [r3]
    subs    r0, r5, r4
    pop     {r4, r5, pc}
    .balign 4
    .ltorg
    .size   measure_strides, . - measure_strides

    /* measure_clear(start, end): start-up's loop. */
    begin   measure_clear, .text.measure
    push    {r4-r11, lr}
    ldr     r10, =CYCCNT
    movs    r2, #0
    mov     r3, r2
    mov     r4, r2
    mov     r5, r2
    mov     r6, r2
    mov     r7, r2
    mov     r8, r2
    mov     r9, r2
    ldr     r11, [r10]
    .balign 4
clear:
    stmia   r0!, {r2-r9}
    cmp     r0, r1
    blo     clear
    ldr     r12, [r10]
    sub     r0, r12, r11
    pop     {r4-r11, pc}
    .ltorg
    .size   measure_clear, . - measure_clear

    /*
     * measure_exceptions(looks): an SVC, PendSV chained to it, and back. Registers that no exception saves carry the looks; a
     * handler's first instruction is one, and its last but one.
     */
    begin   measure_exceptions, .text.measure
    push    {r4-r10, lr}
    ldr     r4, =CYCCNT
    mov     r5, r0
    ldr     r6, =ICSR
    ldr     r7, =PENDSVSET
    ldr     r0, [r4]
    svc     #0
    ldr     r1, [r4]
    stmia   r5!, {r0, r8, r9, r10}
    str     r1, [r5]
    pop     {r4-r10, pc}
    .balign 4
    .ltorg
    .size   measure_exceptions, . - measure_exceptions

    begin   SVC_Handler, .text.measure
    ldr.w   r8, [r4]
    str     r7, [r6]
    dsb
    ldr.w   r9, [r4]
    bx      lr
    .size   SVC_Handler, . - SVC_Handler

    begin   PendSV_Handler, .text.measure
    ldr.w   r10, [r4]
    bx      lr
    .size   PendSV_Handler, . - PendSV_Handler

    /* measure_probe(address, value): true if the load has an answer, which goes to *value. */
    begin   measure_probe, .text.measure
    movs    r2, #1
probed:
    ldr.n   r0, [r0]
    str     r0, [r1]
    mov     r0, r2
    bx      lr
    .size   measure_probe, . - measure_probe

    /* The load above goes without an answer: r2 says so. Whatever else faults is a fault. */
    begin   BusFault_Handler, .text.measure
    ldr     r0, [sp, #FRAME_PC]
    ldr     r1, =probed
    cmp     r0, r1
    bne     another
    adds    r0, r0, #2
    str     r0, [sp, #FRAME_PC]
    movs    r0, #0
    str     r0, [sp, #FRAME_R2]
    ldr     r1, =CFSR
    ldr     r0, [r1]
    str     r0, [r1]
    bx      lr
another:
    b       fault_entry
    .balign 4
    .ltorg
    .size   BusFault_Handler, . - BusFault_Handler
    .end

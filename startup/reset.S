/* SPDX-License-Identifier: MIT */
/*
 * From reset to main().
 *
 * eSRAM comes up with random contents and, when SECDED is on, with random check bits: reading a word that was never
 * written raises an ECC error. So the code below lives in registers until every word has been written, and no
 * instruction in this file touches the stack (UG0331, eSRAM and SECDED chapters).
 *
 * Everything is cleared except .noinit, which holds what has to outlive a reset; at power-on that goes too, because
 * its contents and check bits are random. The reset cause is only read here: it is sticky, and main() clears it when
 * it has taken note. So a reset which comes before that is treated like the one before it.
 *
 * Time: 64 KB at 9 cycles per 32 bytes and 3 for the loop is 25 000 cycles, 0.25 ms at 100 MHz. Even on the 1 MHz
 * standby clock it stays below 100 ms, and the watchdog's time-out is longer, so it needs no refresh on the way.
 */
    .syntax unified
    .cpu    cortex-m3
    .thumb

    .equ    RESET_SOURCE_CR, 0x400380B0     /* SYSREG, UG0331 system registers */
    .equ    POWER_ON,        0x1            /* RESET_SOURCE_CR b0 */
    .equ    SCB_VTOR,        0xE000ED08
    .equ    VECTORS_SIZE,    4 * (16 + 82)  /* startup.h */
    .equ    SCB_CCR,         0xE000ED14
    .equ    CCR_STKALIGN,    0x200
    .equ    STACK_PAINT,     0xC5A3C5A3     /* STARTUP_STACK_PAINT */

    .section .text.Reset_Handler, "ax", %progbits
    .global Reset_Handler
    .type   Reset_Handler, %function
    .thumb_func
Reset_Handler:
    /* A debugger may set the program counter and nothing else: do not rely on the core having loaded these. */
    ldr     r0, =link_stack_top
    msr     msp, r0
    ldr     r0, =vectors
    ldr     r1, =SCB_VTOR
    str     r0, [r1]

    /* r0...r1: what to clear. Both ends are multiples of 32 by the linker script. */
    ldr     r0, =link_ram_start
    ldr     r1, =link_noinit_start
    ldr     r2, =RESET_SOURCE_CR
    ldr     r2, [r2]
    tst     r2, #POWER_ON
    it      ne
    ldrne   r1, =link_ram_end

    movs    r2, #0
    movs    r3, #0
    movs    r4, #0
    movs    r5, #0
    movs    r6, #0
    movs    r7, #0
    mov     r8, r2
    mov     r9, r2
clear:
    stmia   r0!, {r2-r9}
    cmp     r0, r1
    blo     clear

    /* Paint the main stack, to be able to tell later how deep it went. */
    ldr     r0, =link_stack_limit
    ldr     r1, =link_stack_top
    ldr     r2, =STACK_PAINT
paint:
    str     r2, [r0], #4
    cmp     r0, r1
    blo     paint

    /* .data; .bss is clear already. */
    ldr     r0, =link_data_start
    ldr     r1, =link_data_end
    ldr     r2, =link_data_load
    b       copy_test
copy:
    ldr     r3, [r2], #4
    str     r3, [r0], #4
copy_test:
    cmp     r0, r1
    blo     copy

    /* The vectors, and from here on the core takes them from their copy. */
    ldr     r0, =startup_vectors
    ldr     r1, =startup_vectors + VECTORS_SIZE
    ldr     r2, =vectors
copy_vector:
    ldr     r3, [r2], #4
    str     r3, [r0], #4
    cmp     r0, r1
    blo     copy_vector
    ldr     r0, =startup_vectors
    ldr     r1, =SCB_VTOR
    str     r0, [r1]

    /* 8-byte aligned exception frames; the reset value of this bit differs between revisions of the core. */
    ldr     r0, =SCB_CCR
    ldr     r1, [r0]
    orr     r1, r1, #CCR_STKALIGN
    str     r1, [r0]
    dsb
    isb

    bl      main

    /* main() has no reason to return; if it does, stop, and let the watchdog end it. */
    cpsid   i
stop:
    b       stop

    .size   Reset_Handler, . - Reset_Handler
    .end

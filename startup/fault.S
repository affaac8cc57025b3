/* SPDX-License-Identifier: MIT */
/*
 * The entry of all faults and unhandled exceptions.
 *
 * The stack may be what is broken: after an overflow into the guard the stack pointer is useless, and one push would
 * be a second fault and a lock-up. So nothing is pushed before the stack pointer is on the fault stack.
 *
 * The frame is handed on only if it lies where reading it is safe. The guard is the lowest part of RAM, so that is one
 * range: from the end of the guard to the end of RAM.
 */
    .syntax unified
    .cpu    cortex-m3
    .thumb

    .equ    FRAME_SIZE, 32
    .equ    EXC_RETURN_PSP, 4

    .section .text.fault_entry, "ax", %progbits
    .global fault_entry
    .type   fault_entry, %function
    .thumb_func
fault_entry:
    cpsid   i
    tst     lr, #EXC_RETURN_PSP
    ite     eq
    mrseq   r0, msp
    mrsne   r0, psp
    mov     r1, lr

    /* A fault inside fault_taken() has its frame on the fault stack: go on below it, or it would be overwritten. */
    ldr     r2, =link_fault_stack_limit
    ldr     r3, =link_fault_stack_top
    cmp     r0, r2
    blo     switch_stack
    cmp     r0, r3
    blo     check_frame
switch_stack:
    msr     msp, r3

check_frame:
    ldr     r2, =link_stack_limit
    ldr     r3, =link_ram_end
    subs    r3, r3, #FRAME_SIZE
    cmp     r0, r2
    blo     no_frame
    cmp     r0, r3
    bhi     no_frame
    tst     r0, #3
    beq     take
no_frame:
    movs    r0, #0
take:
    bl      fault_taken
stop:
    b       stop

    .size   fault_entry, . - fault_entry

    /* The default: an image that drives nothing has nothing to switch off. */
    .section .text.fault_taken, "ax", %progbits
    .weak   fault_taken
    .type   fault_taken, %function
    .thumb_func
fault_taken:
    bx      lr
    .size   fault_taken, . - fault_taken
    .end

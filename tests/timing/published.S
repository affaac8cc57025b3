/* SPDX-License-Identifier: MIT */
/*
 * Code whose cycles on silicon without wait states are published, and whose instructions the publication determines.
 * Written here; cases.py has the sources and the figures. Each row returns its cycles, or 0 if what it computed is wrong.
 */
#include "tests/timing/sequence.inc"

    .equ MEASURED, 0xFFFFFFFF
    .equ KEY, 0
    .equ ROUND_KEYS, 16
    .equ PLAIN, 192
    .equ CIPHER, 208

    .bss
    .balign 4
aes:
    .space 224

    table

    sequence empty, 4, "the frame: NOP NOP LDR"
    start
    stop

    /* As a caller in C times a function: one read right before its arguments are set up, one right after it. */
    .macro start_call
    ldr r8, =CYCCNT
    nop
    .balign 4
    ldr.w r10, [r8]
    .endm

    .macro stop_call
    ldr.w r11, [r8]
    sub r0, r11, r10
    add r0, r0, #4              @ main() takes the frame off
    .endm

    sequence delay, MEASURED, "delay loop, 100 times"
    mov r2, #400
    start
    nop
1:  subs r2, r2, #4
    bhi 1b
    stop

    sequence aes_expand, MEASURED, "AES-128 key expansion"
    bl fill
    start_call
    mov r0, r9
    add r1, r9, #ROUND_KEYS + 16
    bl expand_key
    stop_call
    ldr r1, =aes + ROUND_KEYS + 160
    ldr r2, =last_round_key
    b compare
    .ltorg

    sequence aes_encrypt, MEASURED, "AES-128, one block"
    bl fill
    mov r0, r9
    add r1, r9, #ROUND_KEYS + 16
    bl expand_key
    start_call
    add r0, r9, #ROUND_KEYS
    add r1, r9, #PLAIN
    add r2, r9, #CIPHER
    bl encrypt_block
    stop_call
    ldr r1, =aes + CIPHER
    ldr r2, =cipher
    b compare
    .ltorg

    /* r0 stays if the four words at r1 and r2 are equal, else it becomes 0. */
    .thumb_func
compare:
    mov r3, #4
1:  ldr r4, [r1], #4
    ldr r5, [r2], #4
    cmp r4, r5
    it ne
    movne r0, #0
    subs r3, r3, #1
    bne 1b
    pop {r4-r11, pc}

    /* FIPS 197, appendix B. r9 = aes. */
    .balign 4
    .thumb_func
fill:
    ldr r9, =aes
    ldr r2, =key
    ldm r2, {r4-r7}
    stm r9, {r4-r7}
    add r3, r9, #ROUND_KEYS
    stm r3, {r4-r7}
    ldr r2, =plain
    ldm r2, {r4-r7}
    add r3, r9, #PLAIN
    stm r3, {r4-r7}
    bx lr
    .ltorg

    .balign 4
key:
    .byte 0x2b, 0x7e, 0x15, 0x16, 0x28, 0xae, 0xd2, 0xa6, 0xab, 0xf7, 0x15, 0x88, 0x09, 0xcf, 0x4f, 0x3c
plain:
    .byte 0x32, 0x43, 0xf6, 0xa8, 0x88, 0x5a, 0x30, 0x8d, 0x31, 0x31, 0x98, 0xa2, 0xe0, 0x37, 0x07, 0x34
cipher:
    .byte 0x39, 0x25, 0x84, 0x1d, 0x02, 0xdc, 0x09, 0xfb, 0xdc, 0x11, 0x85, 0x97, 0x19, 0x6a, 0x0b, 0x32
last_round_key:
    .byte 0xd0, 0x14, 0xf9, 0xa8, 0xc9, 0xee, 0x25, 0x89, 0xe1, 0x3f, 0x0c, 0xc8, 0xb6, 0x63, 0x0c, 0xa6

round_table:
#include "aes_table.inc"

    /* One step of the key expansion on r4...r7: four bytes looked up, eight words combined, four words stored. */
    .macro expand constant, offset
    uxtb r8, r7, ror #8
    uxtb r9, r7, ror #16
    uxtb r10, r7, ror #24
    uxtb r11, r7
    .irp n, r8, r9, r10, r11
    ldrb \n, [r3, \n, lsl #2]
    .endr
    eor r4, #\constant
    eor r4, r4, r8
    eor r4, r4, r9, lsl #8
    eor r4, r4, r10, lsl #16
    eor r4, r4, r11, lsl #24
    eor r5, r4
    eor r6, r5
    eor r7, r6
    str r4, [r1, #\offset]
    str r5, [r1, #\offset + 4]
    str r6, [r1, #\offset + 8]
    str r7, [r1, #\offset + 12]
    .endm

    .balign 4
    .thumb_func
    .type expand_key, %function
expand_key:
    push {r4-r11}
    ldm r0, {r4-r7}
    adr r3, round_table
    expand 0x01, 0
    expand 0x02, 16
    expand 0x04, 32
    expand 0x08, 48
    expand 0x10, 64
    expand 0x20, 80
    expand 0x40, 96
    expand 0x80, 112
    add r1, #128
    expand 0x1B, 0
    expand 0x36, 16
    pop {r4-r11}
    bx lr

    /* One byte of each column: `turn` picks it, a, b, c, d are the columns it comes from; out ^= table, turned by `by`. */
    .macro lookup load, turn, a, b, c, d, oa, ob, oc, od, shift:vararg
    uxtb r0, \a, ror #\turn
    uxtb r1, \b, ror #\turn
    uxtb r2, \c, ror #\turn
    uxtb r3, \d, ror #\turn
    .irp n, r0, r1, r2, r3
    \load \n, [r12, \n, lsl #2]
    .endr
    eor \oa, \oa, r0 \shift
    eor \ob, \ob, r1 \shift
    eor \oc, \oc, r2 \shift
    eor \od, \od, r3 \shift
    .endm

    .macro round a, b, c, d, oa, ob, oc, od
    ldmia r14!, {\oa-\od}
    lookup ldr, 0, \a, \b, \c, \d, \oa, \ob, \oc, \od, , ror #16
    lookup ldr, 8, \b, \c, \d, \a, \oa, \ob, \oc, \od, , ror #8
    lookup ldr, 16, \c, \d, \a, \b, \oa, \ob, \oc, \od
    lookup ldr, 24, \d, \a, \b, \c, \oa, \ob, \oc, \od, , ror #24
    .endm

    .balign 4
    .thumb_func
    .type encrypt_block, %function
encrypt_block:
    push {r2, r4-r11, r14}
    ldm r1, {r4-r7}
    ldmia r0!, {r8-r11}
    mov.w r14, r0
    adr r12, round_table
    eor r4, r8
    eor r5, r9
    eor r6, r10
    eor r7, r11
    .rept 4
    round r4, r5, r6, r7, r8, r9, r10, r11
    round r8, r9, r10, r11, r4, r5, r6, r7
    .endr
    round r4, r5, r6, r7, r8, r9, r10, r11
    ldmia r14!, {r4-r7}
    lookup ldrb, 0, r8, r9, r10, r11, r4, r5, r6, r7
    lookup ldrb, 8, r9, r10, r11, r8, r4, r5, r6, r7, , lsl #8
    lookup ldrb, 16, r10, r11, r8, r9, r4, r5, r6, r7, , lsl #16
    lookup ldrb, 24, r11, r8, r9, r10, r4, r5, r6, r7, , lsl #24
    ldr r0, [sp], #4
    str r4, [r0]
    str r5, [r0, #4]
    str r6, [r0, #8]
    str r7, [r0, #12]
    pop {r4-r11, r14}
    bx lr

    end_of_table

/* SPDX-License-Identifier: MIT */
/*
 * The functions of Lib.h for the Cortex-M3: what lib/transform_s32.h defines, bit for bit. No branch but the return, and
 * the same instructions for all data. The number behind an instruction is its cycles for the longest operands, memory
 * without wait states, by the rules of docs/timing.md; BL's 2 belong to the caller. What makes the order:
 *
 *   a store directly behind a load of one register is free; loads in a row take 1 after the first one's 2
 *   IT is free behind an instruction of 16 bits: so the flags of an addition come from a 16-bit one, or one that leaves
 *   the flags alone (a store, a pop, MOVS of a constant: it changes neither C nor V) stands between
 *
 * Saturating an addition whose V is set, with zero in a register: 0 - 0x80000000 - !C. C is 1 where two negative numbers
 * were added, or a positive one taken from a negative one: 0x80000000; else 0: 0x7FFFFFFF.
 */
#include "lib/Lib.h"
#include "lib/thumb2.h"

#ifdef LIB_THUMB2

    .syntax unified
    .thumb
    .cfi_sections .debug_frame

    .equ    CLARKE_Q32,    0x279A7459           /* round((2 / sqrt(3) - 1) * 2^32) */
    .equ    INVCLARKE_Q32, 0xDDB3D743           /* round((sqrt(3) / 2 - 1) * 2^32), modulo 2^32 */

    .macro  function name
    .section .text.\name, "ax", %progbits
    .p2align 2
    .global \name
    .type   \name, %function
    .thumb_func
\name:
    .cfi_startproc
    .endm

    .macro  end_function name
    .cfi_endproc
    .size   \name, . - \name
    .endm

/* A second name of no size of its own: to a debugger and in lists the function keeps its first. */
    .macro  also name, of
    .global \name
    .thumb_set \name, \of
    .size   \name, 0
    .endm

/* Clarke_Lib_Do(r0 in, r1 out): 21 cycles, 23 with BL. s32_clarke_beta() explains the arithmetic. */
    function Clarke_Lib_Do
    ldr     r2, [r0]                            @ 2  ia
    ldr     r3, [r0, #4]                        @ 1  ib
    str     r2, [r1]                            @ 0  ialpha; all inputs are read
    adds    r3, r3, r2, asr #1                  @ 1  half = ib + (ia >> 1)
    movs    r0, #0                              @ 1
    it      vs                                  @ 0
    sbcvs   r3, r0, #0x80000000                 @ 1  saturated
    movw    r0, #(CLARKE_Q32 & 0xFFFF)          @ 1
    movt    r0, #(CLARKE_Q32 >> 16)             @ 1
    smull   r12, r0, r0, r3                     @ 5  half * CLARKE_Q32
    orr     r12, r12, r2, lsl #31               @ 1  round to nearest, but up if ia is odd
    lsls    r12, r12, #1                        @ 1  C = the rounding
    adcs    r0, r3                              @ 1
    movs    r2, #0                              @ 1
    it      vs                                  @ 0
    sbcvs   r0, r2, #0x80000000                 @ 1  saturated
    str     r0, [r1, #4]                        @ 1  ibeta
    bx      lr                                  @ 2
    end_function Clarke_Lib_Do

/* InvClarke_Lib_Do(r0 in, r1 out): 24 cycles, 26 with BL. s32_invclarke_bc() explains the arithmetic. */
    function InvClarke_Lib_Do
    ldr     r2, [r0]                            @ 2  valpha
    ldr     r3, [r0, #4]                        @ 1  vbeta
    str     r2, [r1]                            @ 0  va; all inputs are read
    mvns    r2, r2                              @ 1  its lowest bit: valpha is even
    movw    r0, #(INVCLARKE_Q32 & 0xFFFF)       @ 1
    movt    r0, #(INVCLARKE_Q32 >> 16)          @ 1
    smull   r12, r0, r0, r3                     @ 5  vbeta * INVCLARKE_Q32
    cmn     r12, r2, lsl #31                    @ 1  C = the rounding: to nearest if even, else down
    adcs    r0, r3                              @ 1  beta = sqrt(3) / 2 vbeta, never overflows
    asrs    r2, r2, #1                          @ 1  C = even
    add     r2, r2, #1                          @ 1  -half, half = valpha >> 1
    sbcs    r12, r2, r0                         @ 1  vc = -half - beta - odd
    movs    r3, #0                              @ 1
    it      vs                                  @ 0
    sbcvs   r12, r3, #0x80000000                @ 1  saturated
    adds    r0, r2                              @ 1  vb = beta - half
    it      vs                                  @ 0
    sbcvs   r0, r3, #0x80000000                 @ 1  saturated
    str     r0, [r1, #4]                        @ 1
    str     r12, [r1, #8]                       @ 1
    bx      lr                                  @ 2
    end_function InvClarke_Lib_Do

/*
 * Park and inverse Park, two of this: sum = a cos + b sin, difference = b cos - a sin. 52 cycles, 54 with BL.
 * Parameters: where a and b are read, and where sum and difference are stored.
 *
 * Only four times INT32_MIN makes a sum that does not fit, 2^63: its high word alone is 0x80000000, and becomes 0x7FFFFFFF.
 * To take LIB_TRIG_FRAC bits off: the high word is saturated to that many bits; if that changed it, the low word becomes all
 * ones (positive) or zero; LSRS leaves the rounding in C. So the last addition overflows exactly where the rounded value is
 * too large.
 */
    .macro  rotate a, b, sum, difference
    sub     sp, #8                              @ 1
    .cfi_def_cfa_offset 8
    ldr     r2, [r0, #\a]                       @ 2
    ldr     r3, [r0, #\b]                       @ 1
    ldr     r12, [r0, #8]                       @ 1  cos
    ldr     r0, [r0, #12]                       @ 1  sin; all inputs are read
    str     r4, [sp]                            @ 0
    .cfi_offset r4, -8
    str     r5, [sp, #4]                        @ 1
    .cfi_offset r5, -4
    smull   r4, r5, r2, r12                     @ 5
    smlal   r4, r5, r3, r0                      @ 7  r5:r4 = a cos + b sin
    smull   r12, r3, r3, r12                    @ 5
    smull   r2, r0, r2, r0                      @ 5
    subs    r2, r12, r2                         @ 1
    sbcs    r3, r0                              @ 1  r3:r2 = b cos - a sin
    rsbs    r0, r5, #0                          @ 1  V if the high word is 0x80000000
    it      vs                                  @ 0
    mvnvs   r5, r5                              @ 1
    ssat    r0, #LIB_TRIG_FRAC, r5              @ 1
    cmp     r0, r5                              @ 1
    it      ne                                  @ 0
    mvnne   r4, r5, asr #31                     @ 1
    lsrs    r4, r4, #LIB_TRIG_FRAC              @ 1
    adcs    r0, r4, r0, lsl #(32 - LIB_TRIG_FRAC) @ 1
    pop     {r4, r5}                            @ 3
    .cfi_restore r4
    .cfi_restore r5
    .cfi_def_cfa_offset 0
    it      vs                                  @ 0
    mvnvs   r0, #0x80000000                     @ 1
    ssat    r12, #LIB_TRIG_FRAC, r3             @ 1
    cmp     r12, r3                             @ 1
    it      ne                                  @ 0
    mvnne   r2, r3, asr #31                     @ 1
    lsrs    r2, r2, #LIB_TRIG_FRAC              @ 1
    adcs    r2, r2, r12, lsl #(32 - LIB_TRIG_FRAC) @ 1
    str     r0, [r1, #\sum]                     @ 1
    it      vs                                  @ 0
    mvnvs   r2, #0x80000000                     @ 1
    str     r2, [r1, #\difference]              @ 1
    bx      lr                                  @ 2
    .endm

/* a = ialpha, b = ibeta: id = ialpha cos + ibeta sin, iq = ibeta cos - ialpha sin */
    function Park_Lib_Do
    rotate  a=0, b=4, sum=0, difference=4
    end_function Park_Lib_Do
    also LIB_CALLED(Park_Lib_Do, LIB_TRIG_FRAC), Park_Lib_Do

/* a = vq, b = vd: vbeta = vq cos + vd sin, valpha = vd cos - vq sin */
    function InvPark_Lib_Do
    rotate  a=4, b=0, sum=4, difference=0
    end_function InvPark_Lib_Do
    also LIB_CALLED(InvPark_Lib_Do, LIB_TRIG_FRAC), InvPark_Lib_Do

#endif

/* SPDX-License-Identifier: MIT */
/*
 * The current loop's interrupt for the encoder, hand-written. current_loop_step.h is the C reference; each remark begins with
 * its cycle count (docs/timing.md; for memory without wait states).
 *
 * The only branch is the one for a fault; otherwise the same instructions for any data. Values stay in registers from the ADC
 * to the compares. Loads are grouped, since a load after a load takes one cycle instead of two, and a store after a load none.
 * An IT block after a 16-bit instruction costs nothing, hence low registers for compared values.
 *
 * LOOP is the structure's address plus 1: storing it to ADC.STATUS acknowledges EOC (a 1) but not OVERRUN and TRIP (0), without
 * another register (axis/axis.h).
 *
 * With two axes each has an entry of its own, and they share the body: some cycles more.
 */
#include "drivers/fabric/offsets.h"
#include "firmware/control/current_loop_layout.h"
#include "lib/factors.h"

        .syntax unified
        .thumb
        .cpu    cortex-m3

#define LOOP   r11
#define FABRIC r10
#define ALPHA  r8
#define BETA   r9
#define SIN    r6
#define COS    r7

        .cfi_sections .debug_frame                      @ what debuggers read here; .eh_frame is not linked

        .section .text.FabricIrq0_IRQHandler, "ax", %progbits
        .p2align 2
#if AXIS_COUNT == 2
/* Two axes: their entries, in the registers that the core has stacked, and the body of both. */
        .global FabricIrq0_IRQHandler
        .type   FabricIrq0_IRQHandler, %function
FabricIrq0_IRQHandler:
        mov     r3, #FABRIC_BASE
        movw    r2, #:lower16:(axes + 1)
        movt    r2, #:upper16:(axes + 1)
        b       current_loop_by_hand
        .size   FabricIrq0_IRQHandler, . - FabricIrq0_IRQHandler

        .global FabricIrq1_IRQHandler
        .type   FabricIrq1_IRQHandler, %function
FabricIrq1_IRQHandler:
        movw    r3, #:lower16:(FABRIC_BASE + FABRIC_AXIS_BYTES)
        movt    r3, #:upper16:(FABRIC_BASE + FABRIC_AXIS_BYTES)
        movw    r2, #:lower16:(axes_second + 1)
        movt    r2, #:upper16:(axes_second + 1)
        b       current_loop_by_hand
        .size   FabricIrq1_IRQHandler, . - FabricIrq1_IRQHandler

#define BODY current_loop_by_hand
#else
#define BODY FabricIrq0_IRQHandler
#endif

        .p2align 2
        .global BODY
        .type   BODY, %function
BODY:                                                   @ 12  entry
        .cfi_startproc
        push    {r4-r11, lr}                            @ 10
        .cfi_def_cfa_offset 36
        .cfi_offset lr, -4
        .cfi_offset r11, -8
        .cfi_offset r10, -12
        .cfi_offset r9, -16
        .cfi_offset r8, -20
        .cfi_offset r7, -24
        .cfi_offset r6, -28
        .cfi_offset r5, -32
        .cfi_offset r4, -36
#if AXIS_COUNT == 2
        mov     FABRIC, r3
        mov     LOOP, r2
#else
        mov     FABRIC, #FABRIC_BASE                    @  1  (not right before its use: that would be one more)
        movw    LOOP, #:lower16:(axes + 1)              @  1
        movt    LOOP, #:upper16:(axes + 1)              @  1
#endif

/* stage: sample */
#if AXIS_COUNT != 2
        .if . - FabricIrq0_IRQHandler != LOOP_BODY
        .error "LOOP_BODY is not where the handler's work begins"
        .endif
#endif
        ldr     ALPHA, [FABRIC, #FABRIC_ADC_IA]         @  2  alpha = i_a
        ldr     BETA, [FABRIC, #FABRIC_ADC_IB]          @  1
        ldr     r0, [LOOP, #LOOP_ANGLE - 1]             @  1
        ldr     r1, [LOOP, #LOOP_ANGLE_OFFSET - 1]      @  1
        ldr     r2, [LOOP, #LOOP_SINE - 1]              @  1

/* stage: Clarke, lib/transform_q15.h */
        movw    r3, #CLARKE_FACTOR_Q17                  @  1
        add     BETA, ALPHA, BETA, lsl #1               @  1  i_a + 2 i_b
        mul     r3, BETA, r3                            @  1
        add     BETA, BETA, r3, asr #CLARKE_SHIFT       @  1  2 beta
        add     BETA, #1                                @  1
        asr     BETA, BETA, #1                          @  1

/* stage: sine and cosine, lib/trig.h */
        adds    r0, r0, r1                              @  1  of the field at the sample
        lsrs    r1, r0, #22                             @  1  chord
        ubfx    r0, r0, #10, #12                        @  1  place on it
        add     r2, r2, r1, lsl #2                      @  1
        subs    r0, #1                                  @  1  (takes the slope out of the word)
        ldr     SIN, [r2]                               @  2
        ldr     COS, [r2, #1024]                        @  1
        sbfx    r1, SIN, #0, #12                        @  1  slopes
        sbfx    r2, COS, #0, #12                        @  1
        mla     SIN, r1, r0, SIN                        @  2
        mla     COS, r2, r0, COS                        @  2
        asrs    SIN, SIN, #15                           @  1
        asrs    COS, COS, #15                           @  1

/* stage: Park, lib/transform_q15.h */
        mul     r3, ALPHA, COS                          @  1
        mla     r3, BETA, SIN, r3                       @  2
        mul     r4, BETA, COS                           @  1
        mls     r4, ALPHA, SIN, r4                      @  2
        asrs    r3, r3, #15                             @  1  carry: the half
        adc     r3, r3, #0                              @  1  i_d
        asrs    r4, r4, #15                             @  1
        adc     r4, r4, #0                              @  1  i_q

/* stage: PI controllers, lib/pi.h */
        ldr     r0, [LOOP, #LOOP_I_D_REF - 1]           @  2
        ldr     r1, [LOOP, #LOOP_I_Q_REF - 1]           @  1
        ldr     r12, [LOOP, #LOOP_KP_D - 1]             @  1
        ldr     lr, [LOOP, #LOOP_KP_Q - 1]              @  1
        ldr     r2, [LOOP, #LOOP_INTEGRAL_D - 1]        @  1
        ldr     r5, [LOOP, #LOOP_INTEGRAL_Q - 1]        @  1
        str     r3, [LOOP, #LOOP_I_D - 1]               @  0
        str     r4, [LOOP, #LOOP_I_Q - 1]               @  1
        subs    r3, r0, r3                              @  1  errors
        subs    r4, r1, r4                              @  1
        mla     r0, r12, r3, r2                         @  2
        mla     r1, lr, r4, r5                          @  2
        ssat    r0, #16, r0, asr #PI_SHIFT              @  1  v_d and v_q without limit
        ssat    r1, #16, r1, asr #PI_SHIFT              @  1
        ldr     r12, [LOOP, #LOOP_TURN - 1]             @  2
        ldr     lr, [LOOP, #LOOP_KI - 1]                @  1
        mul     r3, lr, r3                              @  1  steps of the integrals
        mul     r4, lr, r4                              @  1

/* stage: turn to where the voltages act, lib/advance.h */
        mul     lr, r12, r1                             @  1
        sub     r0, r0, lr, asr #15                     @  1
        mul     lr, r12, r0                             @  1
        add     r1, r1, lr, asr #15                     @  1
        mul     lr, r12, BETA                           @  1
        sub     ALPHA, ALPHA, lr, asr #15               @  1
        mul     lr, r12, ALPHA                          @  1
        add     BETA, BETA, lr, asr #15                 @  1

/* stage: limit of v_d */
        ssat    r12, #LOOP_V_D_BITS, r0                 @  1  v_d
        cmp     r0, r12                                 @  1
        it      gt                                      @  0
        andgt   r3, r3, r3, asr #31                     @  1
        it      lt                                      @  1
        biclt   r3, r3, r3, asr #31                     @  1
        asr     r0, r12, #LOOP_CIRCLE_SHIFT             @  1
        add     r0, LOOP, r0, lsl #1                    @  1
        add     r2, r2, r3, asr #PI_STEP_SHIFT          @  1
        ldrh    r0, [r0, #LOOP_CIRCLE + 2 * LOOP_CIRCLE_ZERO - 1]@  2  largest |v_q|
        str     r2, [LOOP, #LOOP_INTEGRAL_D - 1]        @  0
        str     r12, [LOOP, #LOOP_V_D - 1]              @  1

/* stage: circle: limit of v_q */
        cmp     r1, r0                                  @  1
        itt     gt                                      @  0
        movgt   r1, r0                                  @  1
        andgt   r4, r4, r4, asr #31                     @  1
        cmn     r1, r0                                  @  1
        itt     lt                                      @  0
        rsblt   r1, r0, #0                              @  1
        biclt   r4, r4, r4, asr #31                     @  1

/* stage: inverse Park and Clarke, straight to half on-times */
        mul     r2, r12, COS                            @  1
        mls     r2, r1, SIN, r2                         @  2  a
        mul     r3, r1, COS                             @  1
        mla     r3, r12, SIN, r3                        @  2
        movw    r0, #SIN60_Q15                          @  1  sin 60 deg, Q15
        asrs    r3, r3, #15                             @  1  beta
        muls    r3, r0, r3                              @  1
        sub     r3, r3, r2, asr #1                      @  1  b
        adds    r6, r2, r3                              @  1  -c

/* stage: space vector, lib/modulation.h */
        movt    r0, #:upper16:LOOP_HALF                 @  1  (its lower half is sin 60 deg)
        cmp     r2, r3                                  @  1
        ite     ge                                      @  0
        movge   r7, r2                                  @  1  max(a, b)
        movlt   r7, r3                                  @  1
        sub     r12, r7, r6                             @  1  -min(a, b)
        sub     lr, r0, r6, asr #1                      @  1  the compare at zero voltage
        cmp     r6, r12                                 @  1
        it      gt                                      @  0
        subgt   lr, r0, r12, asr #1                     @  1
        cmn     r6, r7                                  @  1
        it      lt                                      @  0
        addlt   lr, r0, r7, asr #1                      @  1
        add     r2, lr                                  @  1  half on-time of a
        add     r3, lr                                  @  1  of b
        sub     r6, lr, r6                              @  1  of c

/* stage: dead time and compares */
/*
 * Half a dead time for the sign of each current (lib/deadtime.h). A write to the fabric occupies the bus for longer than an
 * instruction takes, so the writes stand apart.
 */
        ssat    r0, #8, ALPHA, asr #DEADTIME_SHIFT      @  1  share of i_a
        mov     r12, #LOOP_DEAD                         @  1
        movw    r7, #SIN60_Q13                          @  1  sin 60 deg, Q13
        mla     r2, r0, r12, r2                         @  2
        asrs    r2, r2, #LOOP_COMPARE_SHIFT             @  1
        str     r2, [FABRIC, #FABRIC_COMPARE_A]         @  1
        mul     r7, BETA, r7                            @  1
        sub     r7, r7, ALPHA, lsl #12                  @  1  i_b, Q28
        add     r0, r7, ALPHA, lsl #13                  @  1  -i_c
        ssat    r7, #8, r7, asr #(13 + DEADTIME_SHIFT)  @  1  share of i_b
        mla     r3, r7, r12, r3                         @  2
        asrs    r3, r3, #LOOP_COMPARE_SHIFT             @  1
        str     r3, [FABRIC, #FABRIC_COMPARE_B]         @  1
        ssat    r0, #8, r0, asr #(13 + DEADTIME_SHIFT)  @  1  share of -i_c
        mls     r6, r0, r12, r6                         @  2
        asrs    r6, r6, #LOOP_COMPARE_SHIFT             @  1
        str     r6, [FABRIC, #FABRIC_COMPARE_C]         @  1  all three, from the next valley on

/* stage: observer, lib/pll.h */
        str     r1, [LOOP, #LOOP_V_Q - 1]               @  1
        add     r5, r5, r4, asr #PI_STEP_SHIFT          @  1  (and the next load is not right after a store)
        ldr     r0, [FABRIC, #FABRIC_ENC_LATCHED]       @  2
        ldr     r2, [LOOP, #LOOP_ENCODER_SCALE - 1]     @  1
        ldr     r4, [LOOP, #LOOP_ANGLE - 1]             @  1
        ldr     r7, [LOOP, #LOOP_SPEED - 1]             @  1
        ldr     r6, [LOOP, #LOOP_STATUS_MAX - 1]        @  1
        str     LOOP, [FABRIC, #FABRIC_ADC_STATUS]      @  0  this conversion is taken
        str     r5, [LOOP, #LOOP_INTEGRAL_Q - 1]        @  1
        muls    r0, r2, r0                              @  1  measured
        subs    r0, r0, r4                              @  1  error
        add     r7, r7, r0, asr #CONFIG_PLL_KI_SHIFT    @  1
        add     r4, r4, r0, asr #CONFIG_PLL_KP_SHIFT    @  1
        adds    r4, r4, r7                              @  1
        ldr     r1, [FABRIC, #FABRIC_GATE_STATUS]       @  2  after the acknowledge: the line has dropped (current_loop_step.h)
        str     r4, [LOOP, #LOOP_ANGLE - 1]             @  0
        str     r7, [LOOP, #LOOP_SPEED - 1]             @  1

/* stage: protection and return */
        cmp     r1, r6                                  @  1
        bhi     .Lloop_fault                            @  1
        pop     {r4-r11, pc}                            @ 10
                                                        @ 12  exit
.Lloop_fault:
#if AXIS_COUNT == 2
        subs    r0, LOOP, #1                            @     the axis: its loop comes first
#endif
        pop     {r4-r11, lr}
        .cfi_def_cfa_offset 0
        .cfi_restore lr
        b       current_loop_fault
        .cfi_endproc
        .size   BODY, . - BODY

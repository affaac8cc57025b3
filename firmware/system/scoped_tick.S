/* SPDX-License-Identifier: MIT */
/*
 * The current loop's entry during a capture (scope/scope.h): raises the sampler's interrupt, counts the tick, and jumps to the
 * handler. Uses only registers that the core has stacked. Cycles as in system/current_loop_isr.S: 13.
 */
        .syntax unified
        .thumb
        .cpu    cortex-m3

        .section .text.scoped_tick, "ax", %progbits
        .p2align 2
        .global scoped_tick
        .type   scoped_tick, %function
scoped_tick:
        movw    r12, #:lower16:scope                    @  1
        movt    r12, #:upper16:scope                    @  1
        ldm     r12, {r0-r3}                            @  5  its bit, where to, the handler, ticks
        str     r0, [r1]                                @  1
        adds    r3, r3, #1                              @  1
        str     r3, [r12, #12]                          @  1
        bx      r2                                      @  3
        .size   scoped_tick, . - scoped_tick

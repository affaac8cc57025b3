/* SPDX-License-Identifier: MIT */
/* Every rule of docs/timing.md with a memory that answers at once, counted by hand. */
#include "tests/timing/sequence.inc"

    table

    sequence empty, 4, "the frame: NOP NOP LDR"
    start
    stop

    /* ---- data processing ---- */

    sequence data, 5, "data processing"
    movs r2, #3
    start
    adds r2, r2, r2             @ 1
    eor.w r3, r2, r2, ror #7    @ 1, the shift is free
    mul r4, r3, r2              @ 1
    ssat r4, #8, r4             @ 1
    clz r5, r4                  @ 1
    stop

    sequence special_registers, 4, "MRS MSR CPS"
    start
    mrs r2, basepri             @ 1
    msr basepri, r2             @ 1
    cpsid i                     @ 1
    cpsie i                     @ 1
    stop

    sequence mla_mls, 4, "MLA MLS"
    start
    mla r2, r3, r4, r5          @ 2
    mls r2, r3, r4, r5          @ 2
    stop

    /* ---- products of 64 bits ---- */

    sequence umull_zero, 6, "UMULL, an operand 0"
    mov r4, #0
    ldr r5, =0x12345678
    start
    umull r2, r3, r4, r5        @ 3
    umull r2, r3, r5, r4        @ 3
    stop

    sequence umull_short, 3, "UMULL, both in 0...65535"
    movw r4, #0xFFFF
    movs r5, #1
    start
    umull r2, r3, r4, r5        @ 3
    stop

    sequence umull_short_m, 4, "UMULL, only Rm in 0...65535"
    movw r4, #0xFFFF
    ldr r5, =0x12345678
    start
    umull r2, r3, r5, r4        @ 4
    stop

    sequence umull_short_n, 5, "UMULL, only Rn in 0...65535"
    movw r4, #0xFFFF
    ldr r5, =0x12345678
    start
    umull r2, r3, r4, r5        @ 5
    stop

    sequence smull_negative, 9, "SMULL, small negative numbers are long"
    mvn r4, #2
    movs r5, #5
    start
    smull r2, r3, r5, r4        @ 5
    smull r2, r3, r4, r5        @ 4: Rm = 5
    stop

    sequence smull_late, 8, "SMULL, an operand written by the instruction before"
    ldr r5, =0x12345678
    movs r6, #0
    start
    movs r4, #7                 @ 1
    smull r2, r3, r4, r4        @ 3: both 7
    mov r4, r5                  @ 1
    umull r2, r3, r4, r6        @ 3: r6 = 0
    stop

    sequence umlal, 15, "UMLAL SMLAL: 3, 5, 7"
    movw r4, #0xFFFF
    ldr r5, =0x12345678
    movs r2, #0
    movs r3, #0
    start
    umlal r2, r3, r4, r4        @ 3
    smlal r2, r3, r5, r4        @ 5
    umlal r2, r3, r5, r5        @ 7
    stop

    sequence long_low_zero, 7, "UMLAL, a zero low half: at most 7"
    mov r4, #0x10000
    ldr r5, =0x12345678
    start
    umlal r2, r3, r5, r4        @ between 3 and 7
    stop

    sequence mla_after_long, 11, "MLA after a 64-bit product"
    ldr r5, =0x12345678
    movs r6, #0
    start
    umull r2, r3, r5, r5        @ 5
    mla r4, r2, r3, r5          @ 1
    umull r2, r3, r4, r6        @ 3: r6 = 0
    mls r4, r2, r3, r5          @ 2
    stop

    /* ---- quotients ---- */

    sequence divide_zero, 4, "UDIV SDIV, 0 / d"
    movs r4, #0
    movs r5, #9
    start
    udiv r2, r4, r5             @ 2
    sdiv r2, r4, r5             @ 2
    stop

    sequence divide_smaller, 6, "UDIV SDIV, |n| < |d|"
    movs r4, #8
    mvn r5, #8                  @ -9
    start
    udiv r2, r4, r5             @ 3
    sdiv r2, r4, r5             @ 3
    stop

    sequence divide_near, 11, "UDIV, bit distance 0 and 4"
    movs r4, #9
    movs r5, #8
    movs r6, #128
    start
    udiv r2, r4, r5             @ 5
    udiv r2, r6, r5             @ 6
    stop

    sequence divide_between, 14, "SDIV, bit distance 5 and 1: at most 7"
    mvn r4, #255                @ -256, 9 bits
    movs r5, #8                 @ 4 bits
    movs r6, #16
    start
    sdiv r2, r4, r5             @ between 6 and 7
    sdiv r2, r6, r5             @ between 5 and 6
    movs r3, #0                 @ 1
    stop

    sequence divide_far, 24, "UDIV, bit distance 28 and 31"
    mvn r4, #0
    movs r5, #8
    movs r6, #1
    start
    udiv r2, r4, r5             @ 5 + 28 / 4
    udiv r2, r4, r6             @ no more than 12
    stop

    /* ---- loads ---- */

    sequence load, 2, "LDR"
    start
    ldr r2, [r0]                @ 2
    stop

    sequence loads, 5, "LDR LDRB LDRH LDRSB in a row"
    start
    ldr r2, [r0]                @ 2
    ldrb r3, [r0, #1]           @ 1
    ldrh r4, [r0, #2]           @ 1
    ldrsb r5, [r1, #1]          @ 1
    stop

    sequence loads_apart, 7, "LDR, something else, LDR"
    start
    ldr r2, [r0]                @ 2
    movs r5, #0                 @ 1
    ldr r3, [r0, #4]            @ 2
    mov r5, r2                  @ 1
    movs r5, #0                 @ 1
    stop

    sequence load_dependent, 4, "LDR from the address just loaded"
    start
    ldr r2, [r0]                @ 2: the buffer's own address
    ldr r3, [r2]                @ 2
    stop

    sequence load_update, 7, "LDR with base update does not pair"
    mov r4, r0
    start
    ldr r2, [r4], #4            @ 2
    ldr r3, [r0]                @ 2
    ldr r5, [r1]                @ 1
    ldr r3, [r4, #4]!           @ 2
    stop

    sequence load_buses, 6, "LDR on different buses"
    start
    ldr r2, [r0]                @ 2, system
    ldr r3, =0x12345678         @ 2, code
    ldr r4, [r12]               @ 2, private
    stop

    sequence load_literals, 3, "LDR of two constants"
    start
    ldr r3, =0x12345678         @ 2
    ldr r4, =0x9ABCDEF0         @ 1
    stop

    sequence load_register, 3, "LDR with register offset"
    movs r4, #4
    start
    ldr r2, [r0, r4]            @ 2
    ldr r3, [r1, r4, lsl #1]    @ 1
    stop

    sequence unaligned, 10, "unaligned loads"
    start
    ldr r2, [r0, #2]            @ 2 + 1
    nop                         @ 1
    ldr r2, [r0, #1]            @ 2 + 2
    ldrh r3, [r0, #7]           @ 1 + 1
    stop

    sequence address_computed, 6, "address computed just before"
    start
    add r4, r0, #4              @ 1
    ldr r2, [r4]                @ 2 + 1
    add r4, r0, #8              @ 1
    movs r2, #0                 @ 1: not directly before
    stop

    sequence address_computed_apart, 4, "address computed earlier"
    start
    add r4, r0, #4              @ 1
    movs r3, #0                 @ 1
    ldr r2, [r4]                @ 2
    stop

    sequence address_low, 6, "address is the low half of a product"
    movs r5, #1
    start
    umull r4, r3, r0, r5        @ 4
    ldr r2, [r4]                @ 2
    stop

    sequence address_high, 8, "address is the high half of a product"
    lsl r4, r0, #1
    mov r5, #0x80000000
    start
    umull r2, r3, r4, r5        @ at most 5
    ldr r2, [r3]                @ 2 + 1
    stop

    /* ---- stores ---- */

    sequence store, 1, "STR"
    start
    str r2, [r1]                @ 1
    stop

    sequence stores, 3, "STR STRB STRH in a row"
    start
    str r2, [r1]                @ 1
    strb r2, [r1, #4]           @ 1
    strh r2, [r1, #6]           @ 1
    stop

    sequence load_store, 2, "LDR STR"
    start
    ldr r2, [r0]                @ 2
    str r2, [r1]                @ 0
    stop

    sequence store_load, 4, "STR LDR"
    start
    str r2, [r1]                @ 1
    ldr r2, [r0]                @ 2 + 1
    stop

    sequence load_store_load, 5, "LDR STR LDR"
    start
    ldr r2, [r0]                @ 2
    str r2, [r1]                @ 0
    ldr r3, [r0]                @ 2 + 1
    stop

    sequence load_store_address, 3, "LDR, STR to the address just loaded"
    start
    ldr r2, [r0]                @ 2
    str r2, [r2]                @ 1: writes what is there
    stop

    sequence store_register, 5, "STR with register offset, alone and after LDR"
    movs r4, #4
    start
    str r2, [r1, r4]            @ 2
    ldr r2, [r0]                @ 2
    str r2, [r1, r4]            @ 1
    stop

    sequence store_update, 8, "STR with base update, then memory"
    mov r4, r1
    start
    str r2, [r4], #4            @ 1
    str r2, [r1]                @ 1 + 1
    nop                         @ 1
    str r2, [r4], #4            @ 1
    ldr r2, [r0]                @ 2 + 1
    stop

    sequence store_update_apart, 4, "STR with base update, then something else"
    mov r4, r1
    start
    str r2, [r4], #4            @ 1
    nop                         @ 1
    ldr r2, [r0]                @ 2
    stop

    sequence exclusive, 5, "LDREX STREX pair like loads"
    start
    ldrex r2, [r1]              @ 2
    strex r3, r2, [r1]          @ 1
    nop                         @ 1
    clrex                       @ 1
    stop

    /* ---- several at once ---- */

    sequence double_, 6, "LDRD STRD"
    start
    ldrd r2, r3, [r0]           @ 3
    strd r2, r3, [r1]           @ 3
    stop

    sequence multiple, 10, "LDM STM of 4"
    start
    ldm r0, {r2-r5}             @ 1 + 4
    stm r1, {r2-r5}             @ 1 + 4
    stop

    sequence push_pop, 8, "PUSH POP of 3"
    start
    push {r2-r4}                @ 1 + 3
    pop {r2-r4}                 @ 1 + 3
    stop

    sequence loads_multiple, 5, "LDR does not pair with LDM"
    start
    ldm r0, {r2, r3}            @ 1 + 2
    ldr r4, [r1]                @ 2
    stop

    /* ---- branches ---- */

    sequence branch, 2, "B"
    start
    b 1f                        @ 2
    .balign 4
1:
    stop

    sequence branch_conditional, 5, "B<c> taken and not taken"
    start
    cmp r0, r0                  @ 1
    bne 1f                      @ 1
    beq 1f                      @ 2
    udf #0
    .balign 4
1:  nop                         @ 1
    stop

    sequence branch_to_next, 3, "B<c> to the next instruction: at most 2"
    start
    cmp r0, r0                  @ 1
    bne 1f                      @ 1, taken 2, and nothing tells
1:
    stop

    sequence loop, 30, "SUBS BNE, 10 times"
    movs r2, #10
    start
    nop                         @ 1, so that the loop is aligned
1:  subs r2, r2, #1             @ 1
    bne 1b                      @ 2, the last 1
    stop

    sequence compare_branch, 4, "CBZ taken, CBNZ not taken"
    movs r2, #0
    start
    cbnz r2, 1f                 @ 1
    cbz r2, 1f                  @ 3
    .balign 4
1:
    stop

    sequence target_split, 5, "B to 32 bits on a halfword address"
    start
    b 1f                        @ 2
    .balign 4
    nop
1:  eor.w r2, r2, r3            @ 1 + 1
    nop                         @ 1
    stop

    sequence target_halfword, 4, "B to 16 bits on a halfword address"
    start
    b 1f                        @ 2
    .balign 4
    nop
1:  movs r2, #0                 @ 1
    nop                         @ 1
    stop

    sequence call, 5, "BL, BX LR at once"
    start
    bl 2f                       @ 2
    stop
    .balign 4
2:  bx lr                       @ 3: LR was just written

    sequence call_nop, 5, "BL, NOP, BX LR"
    start
    bl 2f                       @ 2
    stop
    .balign 4
2:  nop                         @ 1
    bx lr                       @ 2

    sequence call_mov, 5, "BL, NOP, MOV PC,LR"
    start
    bl 2f                       @ 2
    stop
    .balign 4
2:  nop                         @ 1
    mov pc, lr                  @ 2

    sequence call_register, 6, "BLX, NOP, BX LR"
    ldr r2, =2f + 1
    start
    blx r2                      @ 3
    stop
    .balign 4
2:  nop                         @ 1
    bx lr                       @ 2

    sequence branch_register, 3, "BX to another register"
    ldr r2, =1f + 1
    start
    bx r2                       @ 3
    .balign 4
1:
    stop

    sequence call_push, 12, "BL, PUSH, NOP, POP with the PC"
    start
    bl 2f                       @ 2
    stop
    .balign 4
2:  push {r4, lr}               @ 1 + 2
    nop                         @ 1
    pop {r4, pc}                @ 1 + 2 + 3

    sequence load_pc, 5, "LDR PC"
    ldr r2, =1f + 1
    str r2, [r1]
    start
    ldr pc, [r1]                @ 5
    .balign 4
1:
    stop

    sequence table_branch, 6, "TBB"
    movs r2, #0
    start
    tbb [pc, r2]                @ 6
3:  .byte (1f - 3b) / 2, 0
    .balign 4
1:
    stop

    /* ---- conditional instructions ---- */

    sequence it_folded, 4, "IT after 16 bits"
    start
    cmp r0, r0                  @ 1
    ite eq                      @ 0
    moveq r2, #1                @ 1
    movne r2, #2                @ 1, skipped
    nop                         @ 1
    stop

    sequence it_alone, 3, "IT after 32 bits"
    start
    cmp.w r0, r0                @ 1
    it ne                       @ 1
    movne r2, #2                @ 1
    stop

    sequence it_load, 6, "LDR in an IT block, executed and skipped"
    start
    cmp r0, r0                  @ 1
    it eq                       @ 0
    ldreq r2, [r0]              @ 2
    cmp r0, r0                  @ 1
    it ne                       @ 0
    ldrne r2, [r0]              @ 1
    nop                         @ 1
    stop

    sequence it_product, 8, "MLA and UMULL in an IT block, executed and skipped"
    ldr r5, =0x12345678
    movs r6, #0
    start
    cmp r0, r0                  @ 1
    itete eq                    @ 0
    mlaeq r2, r3, r4, r5        @ 2
    mlane r2, r3, r4, r5        @ 1
    umulleq r2, r3, r6, r6      @ 3: r6 = 0
    umullne r2, r3, r5, r5      @ 1
    stop

    sequence it_branch, 5, "B in an IT block"
    start
    cmp r0, r0                  @ 1
    it ne                       @ 0
    bxne lr                     @ 1, skipped
    cmp r0, r0                  @ 1
    it eq                       @ 0
    beq 1f                      @ 2
    .balign 4
1:
    stop

    /* ---- barriers ---- */

    sequence barriers, 8, "DMB DSB: at most 4"
    start
    dmb                         @ between 1 and 4
    dsb                         @ between 1 and 4
    stop

    sequence isb_, 3, "ISB"
    start
    isb                         @ 3
    stop

    /* ---- exceptions ---- */

    sequence exception, 24, "SVC and return"
    movs r3, #0
    start
    svc #0                      @ 1, entry 12, 1 + 0 in the handler, exit 10
    stop

    sequence tail_chain, 46, "SVC, tail-chained PendSV, return by POP"
    movs r3, #1
    start
    svc #0                      @ 1, entry 12, 11 in the handler, 6 to the next, 6 there, exit 10
    stop

    .balign 4
    .global SVC_Handler
    .type SVC_Handler, %function
    .thumb_func
SVC_Handler:
    cbnz r3, 1f                 @ 1, taken 3
    bx lr                       @ 0: in exit
    .balign 4
1:  ldr r2, =0xE000ED04         @ 2: ICSR
    mov r1, #0x10000000         @ 1: PENDSVSET
    str r1, [r2]                @ 1
    dsb                         @ at most 4
    bx lr                       @ 0: in the tail-chain
    .ltorg

    .balign 4
    .global PendSV_Handler
    .type PendSV_Handler, %function
    .thumb_func
PendSV_Handler:
    push {r4, lr}               @ 1 + 2
    pop {r4, pc}                @ 1 + 2, the rest is in exit

    /* ---- the counter ---- */

    sequence adjacent_reads, 1, "two reads of CYCCNT in a row"
    start
    ldr.w r10, [r12]
    ldr.w r11, [r12]            @ 1: pairs with the first
    sub r0, r11, r10
    add r0, r0, #4              @ main() takes the frame off
    pop {r4-r11, pc}
    .ltorg

    end_of_table

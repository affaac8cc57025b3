/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "cycles_decode.h"

#include <string.h>

#define PC 15
#define LR 14
#define SP 13

static unsigned field(unsigned word, unsigned low, unsigned bits)
{
    return word >> low & ((1u << bits) - 1);
}

static uint16_t bit(unsigned reg)
{
    return (uint16_t)(1u << reg);
}

static int32_t sign_extended(uint32_t value, unsigned bits)
{
    return (int32_t)(value << (32 - bits)) >> (32 - bits);
}

unsigned cycles_size(uint16_t halfword)
{
    return halfword >= 0xE800 ? 4 : 2;
}

unsigned cycles_it_block(uint16_t halfword, uint8_t conditions[4])
{
    unsigned mask = field(halfword, 0, 4), first = field(halfword, 4, 4), count = 0;
    for (unsigned n = 0; n < 4 && (mask & (0xFu >> n)) != 0; n++) {
        /* The lowest set bit of the mask ends the block; the bits above it are the last bits of the conditions. */
        unsigned last = n == 0 ? first & 1 : mask >> (4 - n) & 1;
        conditions[count++] = (uint8_t)((first & 0xE) | last);
    }
    return count;
}

/* ---- building blocks ---- */

static void result(struct cycles_op *op, unsigned reg)
{
    if (reg != PC) {
        op->writes = bit(reg);
    }
}

static void branch_to_register(struct cycles_op *op, unsigned reg)
{
    op->class = reg == LR ? CYCLES_BRANCH_LR : CYCLES_BRANCH_REGISTER;
}

static void branch(struct cycles_op *op, int32_t offset, bool conditional)
{
    op->class = CYCLES_BRANCH;
    op->conditional = conditional;
    op->target = op->address + 4 + (uint32_t)offset;
}

static void load(struct cycles_op *op, unsigned reg, unsigned bytes)
{
    op->class = reg == PC ? CYCLES_LOAD_PC : CYCLES_LOAD;
    op->is_load = true;
    op->access_bytes = (uint8_t)bytes;
    op->loads = reg == PC ? 0 : bit(reg);
}

static void store(struct cycles_op *op, unsigned bytes)
{
    op->class = CYCLES_STORE;
    op->is_store = true;
    op->access_bytes = (uint8_t)bytes;
}

static void load_or_store(struct cycles_op *op, bool is_load, unsigned reg, unsigned bytes)
{
    if (is_load) {
        load(op, reg, bytes);
    } else {
        store(op, bytes);
    }
}

static void multiple(struct cycles_op *op, bool is_load, unsigned base, unsigned list)
{
    op->class = CYCLES_MULTIPLE;
    op->is_load = is_load;
    op->is_store = !is_load;
    op->access_bytes = 4;
    op->transfers = (uint8_t)__builtin_popcount(list);
    op->pops_pc = is_load && (list & bit(PC));
    op->loads = is_load ? (uint16_t)(list & 0x7FFF) : 0;
    op->address_registers = bit(base);
}

/* ---- 16 bits ---- */

static void decode_special(struct cycles_op *op, unsigned code)
{
    unsigned destination = field(code, 0, 3) | field(code, 7, 1) << 3, source = field(code, 3, 4);
    switch (field(code, 8, 2)) {
    case 0: /* ADD */
    case 2: /* MOV */
        if (destination == PC) {
            branch_to_register(op, field(code, 8, 2) == 2 ? source : PC);
        }
        result(op, destination);
        break;
    case 1: /* CMP */
        break;
    default:
        branch_to_register(op, code & 0x80 ? PC : source); /* BLX is never the short one */
        op->writes = code & 0x80 ? bit(LR) : 0;
        break;
    }
}

static void decode_register_offset(struct cycles_op *op, unsigned code)
{
    /* STR STRH STRB LDRSB LDR LDRH LDRB LDRSH */
    static const uint8_t bytes[8] = {4, 2, 1, 1, 4, 2, 1, 2};
    unsigned which = field(code, 9, 3);
    load_or_store(op, which >= 3, field(code, 0, 3), bytes[which]);
    op->register_offset = true;
    op->address_registers = bit(field(code, 3, 3)) | bit(field(code, 6, 3));
}

static void decode_immediate_offset(struct cycles_op *op, unsigned code)
{
    bool is_load = code & 0x0800;
    if (code >> 12 == 9) { /* relative to SP */
        load_or_store(op, is_load, field(code, 8, 3), 4);
        op->address_registers = bit(SP);
        return;
    }
    unsigned bytes = code >> 12 == 6 ? 4 : code >> 12 == 7 ? 1 : 2;
    load_or_store(op, is_load, field(code, 0, 3), bytes);
    op->address_registers = bit(field(code, 3, 3));
}

static void decode_miscellaneous(struct cycles_op *op, unsigned code)
{
    if ((code & 0xF500) == 0xB100) {
        op->class = CYCLES_COMPARE_BRANCH;
        op->target = op->address + 4 + (field(code, 9, 1) << 6 | field(code, 3, 5) << 1);
    } else if ((code & 0xFF00) == 0xB000) {
        op->writes = bit(SP);
    } else if ((code & 0xFE00) == 0xB400) {
        multiple(op, false, SP, (code & 0xFF) | field(code, 8, 1) << LR);
    } else if ((code & 0xFE00) == 0xBC00) {
        multiple(op, true, SP, (code & 0xFF) | field(code, 8, 1) << PC);
    } else if ((code & 0xFF00) == 0xB200 || (code & 0xFF00) == 0xBA00) { /* extensions, reversals */
        op->writes = bit(field(code, 0, 3));
    } else if ((code & 0xFF00) == 0xBF00 && (code & 0xF) != 0) {
        op->class = CYCLES_IT;
    }
}

static void decode_low_registers(struct cycles_op *op, unsigned code)
{
    if (code >> 10 == 0x10) { /* data processing, register */
        unsigned which = field(code, 6, 4);
        op->writes = which == 8 || which == 10 || which == 11 ? 0 : bit(field(code, 0, 3)); /* TST CMP CMN */
    } else if (code >> 13 == 1) { /* MOV CMP ADD SUB with 8 bits */
        op->writes = code >> 11 == 5 ? 0 : bit(field(code, 8, 3));
    } else {
        op->writes = bit(field(code, 0, 3));
    }
}

static void decode_16(struct cycles_op *op, unsigned code)
{
    if (code >> 10 <= 0x10) {
        decode_low_registers(op, code);
    } else if (code >> 10 == 0x11) {
        decode_special(op, code);
    } else if (code >> 11 == 9) {
        load(op, field(code, 8, 3), 4); /* literal: the address needs no register */
    } else if (code >> 12 == 5) {
        decode_register_offset(op, code);
    } else if (code >> 12 <= 9) {
        decode_immediate_offset(op, code);
    } else if (code >> 12 == 0xA) {
        op->writes = bit(field(code, 8, 3));
    } else if (code >> 12 == 0xB) {
        decode_miscellaneous(op, code);
    } else if (code >> 12 == 0xC) {
        multiple(op, code & 0x0800, field(code, 8, 3), code & 0xFF);
    } else if (code >> 11 == 0x1C) {
        branch(op, sign_extended(field(code, 0, 11) << 1, 12), false);
    } else if (code >> 8 < 0xDE) {
        branch(op, sign_extended(field(code, 0, 8) << 1, 9), true);
    } /* else SVC, UDF: the exception costs, not the instruction */
}

/* ---- 32 bits ---- */

static void decode_double_or_exclusive(struct cycles_op *op, unsigned first, unsigned second)
{
    bool is_load = first & 0x10;
    op->address_registers = bit(field(first, 0, 4));
    if ((first & 0xFFF0) == 0xE8D0 && (second & 0xFFE0) == 0xF000) {
        op->class = CYCLES_TABLE;
        op->is_load = true;
        op->access_bytes = second & 0x10 ? 2 : 1;
        op->address_registers = (uint16_t)((op->address_registers | bit(field(second, 0, 4))) & 0x7FFF);
    } else if ((first & 0x0120) == 0) { /* exclusive; a store-exclusive answers like a load */
        unsigned status = (first & 0x80) ? field(second, 0, 4) : field(second, 8, 4);
        load(op, is_load ? field(second, 12, 4) : status, 4);
        op->is_store = !is_load;
    } else {
        op->class = CYCLES_DOUBLE;
        op->is_load = is_load;
        op->is_store = !is_load;
        op->access_bytes = 4;
        op->base_update = first & 0x20;
        op->loads = is_load ? bit(field(second, 12, 4)) | bit(field(second, 8, 4)) : 0;
        op->address_registers &= 0x7FFF;
    }
}

static void decode_single(struct cycles_op *op, unsigned first, unsigned second)
{
    static const uint8_t sizes[4] = {1, 2, 4, 4};
    unsigned base = field(first, 0, 4), reg = field(second, 12, 4), bytes = sizes[field(first, 5, 2)];
    bool is_load = first & 0x10;
    if (is_load && reg == PC && bytes != 4) {
        return; /* a preload hint */
    }
    load_or_store(op, is_load, reg, bytes);
    op->address_registers = base == PC ? 0 : bit(base);
    if (base == PC || (first & 0x80)) {
        return;
    }
    if (second & 0x0800) {
        op->base_update = (second & 0x0100) != 0; /* W: pre-indexed with update, and every post-indexed form */
    } else {
        op->register_offset = true;
        op->address_registers |= bit(field(second, 0, 4));
    }
}

static void decode_control(struct cycles_op *op, unsigned first, unsigned second)
{
    uint32_t s = field(first, 10, 1), j1 = field(second, 13, 1), j2 = field(second, 11, 1);
    if (second & 0x1000) { /* B, BL with 24 bits */
        uint32_t i1 = !(j1 ^ s), i2 = !(j2 ^ s);
        uint32_t offset = s << 24 | i1 << 23 | i2 << 22 | field(first, 0, 10) << 12 | field(second, 0, 11) << 1;
        branch(op, sign_extended(offset, 25), false);
        op->writes = second & 0x4000 ? bit(LR) : 0;
    } else if (field(first, 7, 3) != 7) { /* B<c> with 20 bits */
        uint32_t offset = s << 20 | j2 << 19 | j1 << 18 | field(first, 0, 6) << 12 | field(second, 0, 11) << 1;
        branch(op, sign_extended(offset, 21), true);
    } else if (first == 0xF3BF && (second & 0xFF00) == 0x8F00) {
        unsigned which = field(second, 4, 4);
        op->class = which == 6 ? CYCLES_ISB : which == 4 || which == 5 ? CYCLES_BARRIER : CYCLES_DATA;
    } else if ((first & 0xFFE0) == 0xF3E0) { /* MRS */
        result(op, field(second, 8, 4));
    }
}

static void decode_multiply(struct cycles_op *op, unsigned first, unsigned second)
{
    if (field(second, 4, 4) != 0) {
        op->class = CYCLES_MLS;
    } else if (field(second, 12, 4) != PC) {
        op->class = CYCLES_MLA;
    }
    (void)first;
    result(op, field(second, 8, 4));
}

static void decode_long(struct cycles_op *op, unsigned first, unsigned second)
{
    unsigned which = field(first, 4, 3);
    op->n = (uint8_t)field(first, 0, 4);
    op->m = (uint8_t)field(second, 0, 4);
    if (which == 1 || which == 3) {
        op->class = CYCLES_DIVIDE;
        op->is_signed = which == 1;
    } else {
        op->class = which < 4 ? CYCLES_LONG_MUL : CYCLES_LONG_MLA;
    }
    result(op, field(second, 8, 4));
}

static void decode_32(struct cycles_op *op, unsigned first, unsigned second)
{
    unsigned group = field(first, 11, 2), which = field(first, 4, 7);
    if (group == 1 && (which & 0x64) == 0) {
        multiple(op, first & 0x10, field(first, 0, 4), second);
    } else if (group == 1 && (which & 0x64) == 4) {
        decode_double_or_exclusive(op, first, second);
    } else if (group == 2 && (second & 0x8000)) {
        decode_control(op, first, second);
    } else if (group != 3) {
        result(op, field(second, 8, 4)); /* data processing; with the PC as destination it only sets flags */
    } else if ((which & 0x60) == 0) {
        decode_single(op, first, second);
    } else if ((which & 0x78) == 0x30) {
        decode_multiply(op, first, second);
    } else if ((which & 0x78) == 0x38) {
        decode_long(op, first, second);
    } else {
        result(op, field(second, 8, 4));
    }
}

void cycles_decode(struct cycles_op *op, uint32_t address, const uint16_t halfwords[2])
{
    memset(op, 0, sizeof *op);
    op->address = address;
    op->condition = CYCLES_ALWAYS;
    op->count = 1;
    op->size = (uint8_t)cycles_size(halfwords[0]);
    op->class = CYCLES_DATA;
    if (op->size == 2) {
        decode_16(op, halfwords[0]);
    } else {
        decode_32(op, halfwords[0], halfwords[1]);
    }
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What the timing of one Thumb-2 instruction depends on, found once from its encoding. ARMv7-M Architecture Reference
 * Manual, A5 (encoding tables) and A7 (instructions). Not a disassembler: what costs the same is the same here. */
#ifndef TWIN_CYCLES_DECODE_H
#define TWIN_CYCLES_DECODE_H

#include <stdbool.h>
#include <stdint.h>

enum cycles_class {
    CYCLES_DATA, /* data processing, MUL, hints, MSR, MRS, CPS */
    CYCLES_MLA,
    CYCLES_MLS,
    CYCLES_LONG_MUL, /* SMULL, UMULL */
    CYCLES_LONG_MLA, /* SMLAL, UMLAL */
    CYCLES_DIVIDE,
    CYCLES_LOAD, /* one register, not the PC */
    CYCLES_LOAD_PC,
    CYCLES_STORE,           /* one register; also exclusive, which are like loads: is_load tells */
    CYCLES_DOUBLE,          /* LDRD, STRD */
    CYCLES_MULTIPLE,        /* LDM, STM, PUSH, POP */
    CYCLES_TABLE,           /* TBB, TBH */
    CYCLES_BRANCH,          /* B, B<c>, BL: the target is in the encoding */
    CYCLES_COMPARE_BRANCH,  /* CBZ, CBNZ */
    CYCLES_BRANCH_LR,       /* BX LR, MOV PC,LR */
    CYCLES_BRANCH_REGISTER, /* every other way to put a register into the PC */
    CYCLES_IT,
    CYCLES_BARRIER, /* DMB, DSB */
    CYCLES_ISB,
    CYCLES_CLASSES,
};

struct cycles_op;

struct cycles_op {
    uint32_t address;
    uint8_t size; /* bytes: 2 or 4 */
    uint8_t class;
    uint8_t transfers;    /* of CYCLES_MULTIPLE */
    uint8_t access_bytes; /* of a single access */
    bool is_load, is_store;
    bool register_offset;
    bool base_update;
    bool pops_pc;      /* CYCLES_MULTIPLE that loads the PC */
    bool is_signed;    /* divides */
    uint8_t n, m;      /* the operands whose values matter */
    uint8_t condition; /* 14: always; otherwise the condition its IT block puts on it */
    uint16_t writes;   /* registers a data-processing result goes to, as a mask; of a 64-bit product only RdHi */
    uint16_t loads;    /* registers a load writes */
    uint16_t address_registers;
    uint32_t target;     /* of CYCLES_BRANCH and CYCLES_COMPARE_BRANCH */
    bool conditional;    /* of CYCLES_BRANCH: it may fall through */
    bool starts_handler; /* an exception vector points here */
    /* Instructions that are executed one after the other whatever happens are announced as one (cycles_join()). */
    unsigned count;               /* that stand for, this one and those after it; 1: this one alone */
    const struct cycles_op *next; /* of them */
};

#define CYCLES_ALWAYS 14

/* `halfwords`: the instruction's encoding; the second is looked at only if there is one. Fills everything but
 * condition (always), starts_handler (false) and count (1), which the encoding does not tell. */
void cycles_decode(struct cycles_op *op, uint32_t address, const uint16_t halfwords[2]);

/* Bytes of the instruction that begins with this halfword. */
unsigned cycles_size(uint16_t halfword);

/* The conditions that an IT instruction puts on those after it; returns how many there are, up to 4. */
unsigned cycles_it_block(uint16_t halfword, uint8_t conditions[4]);

#endif

/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "cycles_table.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cycles.h"

#define SLOTS         65536u /* of halfword addresses, by their low bits; M2S010 holds 128 K halfwords of code at most */
#define VECTORS       98     /* 16 of the core, 82 of SmartFusion2 */
#define FIRST_HANDLER 2

/* Where the vector table may stand: where reset finds it, and where the firmware's linker script puts its copy. */
static const uint32_t tables[] = {0, 0x2000FA00};

typedef void reader(uint32_t address, void *bytes, size_t length);

struct entry {
    struct cycles_op op;
    uint16_t halfwords[2];
    struct entry *next;
    struct entry *longer; /* the same instruction at the head of a run of one more */
};

static struct entry *slots[SLOTS];

/* Memory that holds something else there does no harm: what is no handler has no exception's number. */
static bool is_handler(uint32_t address, reader *read)
{
    for (size_t t = 0; t < sizeof tables / sizeof tables[0]; t++) {
        uint32_t vectors[VECTORS];
        read(tables[t], vectors, sizeof vectors);
        for (int n = FIRST_HANDLER; n < VECTORS; n++) {
            if (vectors[n] == (address | 1)) {
                return true;
            }
        }
    }
    return false;
}

static struct entry *new_entry(void)
{
    struct entry *e = calloc(1, sizeof *e);
    if (!e) {
        fputs("mssfoc twin: out of memory\n", stderr);
        exit(1);
    }
    return e;
}

static struct entry *add(uint32_t address, const uint16_t halfwords[2], reader *read)
{
    struct entry *e = new_entry();
    cycles_decode(&e->op, address, halfwords);
    e->op.starts_handler = is_handler(address, read);
    memcpy(e->halfwords, halfwords, sizeof e->halfwords);
    e->next = slots[address / 2 % SLOTS];
    slots[address / 2 % SLOTS] = e;
    return e;
}

static struct entry *find(uint32_t address, reader *read)
{
    uint16_t halfwords[2] = {0, 0};
    read(address, halfwords, 2);
    if (cycles_size(halfwords[0]) == 4) {
        read(address + 2, &halfwords[1], 2);
    }
    for (struct entry *e = slots[address / 2 % SLOTS]; e; e = e->next) {
        if (e->op.address == address && memcmp(e->halfwords, halfwords, sizeof halfwords) == 0) {
            return e;
        }
    }
    return add(address, halfwords, read);
}

/* The instructions of an IT block are found from the IT: QEMU may translate the block in two pieces. */
static void mark_it_block(const struct entry *it, reader *read)
{
    uint8_t conditions[4];
    unsigned count = cycles_it_block(it->halfwords[0], conditions);
    uint32_t address = it->op.address + it->op.size;
    for (unsigned n = 0; n < count; n++) {
        struct entry *e = find(address, read);
        e->op.condition = conditions[n];
        address += e->op.size;
    }
}

const struct cycles_op *cycles_lookup(uint32_t address, reader *read)
{
    struct entry *e = find(address, read);
    if (e->op.class == CYCLES_IT) {
        mark_it_block(e, read);
    }
    return &e->op;
}

/* Where an instruction goes, what it accesses and what its registers hold is known once it is executed. */
static bool follows(const struct cycles_op *last, const struct cycles_op *next)
{
    bool goes_on = last->class < CYCLES_LOAD || last->class == CYCLES_IT;
    return goes_on && next->address == last->address + last->size && !cycles_wants_registers(next);
}

static struct entry *lengthened(const struct cycles_op *piece)
{
    struct entry *e = new_entry();
    e->op = *piece;
    e->op.count++;
    return e;
}

const struct cycles_op *cycles_join(const struct cycles_op *piece, const struct cycles_op *next)
{
    struct entry *e = (struct entry *)piece; /* of which it is the first member */
    struct cycles_op *last = &e->op;
    for (unsigned left = piece->count; left > 1; left--) {
        last = (struct cycles_op *)last->next;
    }
    if (!follows(last, next)) {
        return NULL;
    }
    last->next = next;
    if (!e->longer) {
        e->longer = lengthened(piece);
    }
    return &e->longer->op;
}

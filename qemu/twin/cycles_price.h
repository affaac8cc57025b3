/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What one instruction costs: by what it is, what stands before it, and where execution goes on. docs/timing.md. */
#ifndef TWIN_CYCLES_PRICE_H
#define TWIN_CYCLES_PRICE_H

#include "cycles.h"

/* An instruction as it was executed. */
struct cycles_step {
    const struct cycles_op *op;
    bool accessed, skipped, returns;
    uint32_t address;
    struct cycles_count by_operands; /* of classes whose cost depends on values */
};

/* Where it stands. */
struct cycles_place {
    const struct cycles_step *before; /* its op is NULL where nothing is before: behind an exception's entry */
    const struct cycles_op *next;     /* NULL where the instruction is a load that has not ended yet */
    bool interrupted;                 /* an exception is entered behind it */
    uint64_t spent;                   /* all that was before */
    uint64_t *bus_free;               /* when the posted write on the system bus is done; a store moves it */
};

void cycles_price_init(const struct cycles_params *params);

static inline unsigned cycles_envm_waits(const struct cycles_params *p)
{
    return p->cache == CYCLES_CACHE_HITS ? 0 : (unsigned)p->envm_wait;
}

static inline bool cycles_touch_memory(const struct cycles_op *op)
{
    return op->is_load || op->is_store;
}

/* Of classes whose cost depends on values: the operands as they are before it executes. */
struct cycles_count cycles_price_product(const struct cycles_op *op, uint32_t n, uint32_t m);
struct cycles_count cycles_price_quotient(const struct cycles_op *op, uint32_t n, uint32_t d);

struct cycles_count cycles_price(const struct cycles_step *step, const struct cycles_place *place);

#endif

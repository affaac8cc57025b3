/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "cycles_price.h"

#include "cycles_cache.h"
#include "cycles_rules.h"

#define LR 14

enum bus { BUS_CODE, BUS_SYSTEM, BUS_PRIVATE };

static struct {
    unsigned apb_read, apb_write, ppb, esram, envm;
} waits;
static void add_rule(struct cycles_count *cost, enum cycles_rule rule)
{
    cost->low += cycles_rules[rule].low;
    cost->high += cycles_rules[rule].high;
}

static void add_exactly(struct cycles_count *cost, uint64_t cycles)
{
    cost->low += cycles;
    cost->high += cycles;
}

static enum bus bus_of(uint32_t address)
{
    return address < 0x20000000u ? BUS_CODE : address >> 20 == 0xE00 ? BUS_PRIVATE : BUS_SYSTEM;
}

static unsigned wait_of(uint32_t address, bool is_write)
{
    switch (address >> 28) {
    case 0:
    case 1:
        return cycles_cache_waits(address);
    case 6:
        return waits.envm;
    case 2:
        return is_write ? 0 : waits.esram;
    case 0xE:
        return waits.ppb;
    default:
        return is_write ? waits.apb_write : waits.apb_read;
    }
}

/* ---- products and quotients, from the values they work on ---- */

static bool is_short(uint32_t value)
{
    return value <= 0xFFFF;
}

struct cycles_count cycles_price_product(const struct cycles_op *op, uint32_t n, uint32_t m)
{
    bool accumulates = op->class == CYCLES_LONG_MLA;
    struct cycles_count cost = {0, 0};
    if (n == 0 || m == 0 || (is_short(n) && is_short(m))) {
        add_rule(&cost, RULE_LONG_EARLY);
        return cost;
    }
    add_rule(&cost, is_short(m) ? (accumulates ? RULE_LONG_MLA_SHORT_M : RULE_LONG_MUL_SHORT_M)
                                : (accumulates ? RULE_LONG_MLA : RULE_LONG_MUL));
    if ((n & 0xFFFF) == 0 || (m & 0xFFFF) == 0) {
        cost.low = cycles_rules[RULE_LONG_EARLY].low; /* a zero low half: known to lie between */
    }
    return cost;
}

static unsigned bits(uint32_t value)
{
    return 32 - (unsigned)__builtin_clz(value);
}

struct cycles_count cycles_price_quotient(const struct cycles_op *op, uint32_t n, uint32_t d)
{
    struct cycles_count cost = {0, 0};
    if (n == 0 || d == 0) {
        add_rule(&cost, RULE_DIVIDE_ZERO);
        return cost;
    }
    uint32_t n_abs = op->is_signed && n >> 31 ? -n : n, d_abs = op->is_signed && d >> 31 ? -d : d;
    if (n_abs < d_abs) {
        add_rule(&cost, RULE_DIVIDE_SMALLER);
        return cost;
    }
    unsigned distance = bits(n_abs) - bits(d_abs);
    add_rule(&cost, RULE_DIVIDE);
    cost.low += distance / 4;
    cost.high += (distance + 3) / 4;
    cost.high = cost.high > 12 ? 12 : cost.high; /* TRM 3.3 */
    return cost;
}

/* ---- loads and stores ---- */

static bool pairs_with_load_before(const struct cycles_place *p, const struct cycles_step *s)
{
    const struct cycles_step *before = p->before;
    const struct cycles_op *first = before->op;
    return first && first->class == CYCLES_LOAD && before->accessed && !first->base_update && !s->op->base_update &&
           bus_of(before->address) == bus_of(s->address) && !(first->loads & s->op->address_registers);
}

static void add_neighbour(struct cycles_count *cost, const struct cycles_place *p, const struct cycles_step *s)
{
    const struct cycles_step *before = p->before;
    const struct cycles_op *first = before->op;
    if (!first) {
        return;
    }
    if (!before->skipped && (first->writes & s->op->address_registers)) {
        add_rule(cost, RULE_ADDRESS_JUST_COMPUTED);
    }
    if (first->class != CYCLES_STORE || !before->accessed) {
        return;
    }
    if (first->base_update) {
        add_rule(cost, RULE_MEMORY_AFTER_UPDATING_STORE);
    } else if (s->op->is_load && !first->register_offset) {
        add_rule(cost, bus_of(before->address) == bus_of(s->address) ? RULE_LOAD_AFTER_STORE
                                                                     : RULE_LOAD_AFTER_STORE_ELSEWHERE);
    }
}

static unsigned unaligned_parts(const struct cycles_step *s)
{
    const struct cycles_op *op = s->op;
    if (op->class != CYCLES_LOAD || (s->address & (op->access_bytes - 1u)) == 0) {
        return 0;
    }
    return op->access_bytes == 4 && s->address % 2 != 0 ? 2 : 1;
}

/* Wait states. A load waits for its own; the last write of a store is posted, and what comes next on the bus waits. */
static void add_bus(struct cycles_count *cost, const struct cycles_place *p, const struct cycles_step *s)
{
    const struct cycles_op *op = s->op;
    unsigned transfers = op->class == CYCLES_MULTIPLE ? op->transfers : op->class == CYCLES_DOUBLE ? 2 : 1;
    unsigned wait = wait_of(s->address, op->is_store);
    if (bus_of(s->address) != BUS_SYSTEM) {
        add_exactly(cost, (uint64_t)wait * transfers);
        return;
    }
    if (*p->bus_free > p->spent) {
        add_exactly(cost, *p->bus_free - p->spent);
    }
    if (op->is_store && !op->is_load) {
        add_exactly(cost, (uint64_t)wait * (transfers - 1));
        *p->bus_free = p->spent + cost->high + wait;
    } else {
        add_exactly(cost, (uint64_t)wait * transfers);
    }
}

static void add_memory(struct cycles_count *cost, const struct cycles_place *p, const struct cycles_step *s)
{
    const struct cycles_op *op = s->op;
    bool paired = pairs_with_load_before(p, s);
    switch (op->class) {
    case CYCLES_LOAD:
        add_rule(cost, paired ? RULE_LOAD_PIPELINED : RULE_LOAD);
        add_exactly(cost, (uint64_t)cycles_rules[RULE_UNALIGNED].high * unaligned_parts(s));
        break;
    case CYCLES_STORE:
        add_rule(cost, op->register_offset ? (paired ? RULE_STORE_REGISTER_PIPELINED : RULE_STORE_REGISTER)
                                           : (paired ? RULE_STORE_PIPELINED : RULE_STORE));
        break;
    case CYCLES_DOUBLE:
        add_rule(cost, RULE_DOUBLE);
        break;
    case CYCLES_MULTIPLE:
        add_rule(cost, RULE_MULTIPLE);
        add_exactly(cost, (uint64_t)cycles_rules[RULE_TRANSFER].high * op->transfers);
        if (op->pops_pc && !s->returns) {
            add_rule(cost, RULE_POP_PC);
        }
        break;
    default:
        add_rule(cost, op->class == CYCLES_TABLE ? RULE_TABLE : RULE_LOAD_PC);
        break;
    }
    add_neighbour(cost, p, s);
    add_bus(cost, p, s);
}

/* ---- one instruction ---- */

static enum cycles_rule branch_rule(const struct cycles_op *op, const struct cycles_op *next, bool interrupted)
{
    bool compares = op->class == CYCLES_COMPARE_BRANCH,
         may_fall_through = op->conditional || compares || op->condition != CYCLES_ALWAYS;
    if (may_fall_through && interrupted) {
        return compares ? RULE_COMPARE_BRANCH_UNKNOWN : RULE_BRANCH_UNKNOWN;
    }
    if (may_fall_through && next->address == op->address + op->size) {
        if (op->target == next->address) {
            return compares ? RULE_COMPARE_BRANCH_UNKNOWN : RULE_BRANCH_UNKNOWN;
        }
        return RULE_BRANCH_NOT_TAKEN;
    }
    return compares ? RULE_COMPARE_BRANCH : RULE_BRANCH;
}

static enum cycles_rule register_branch_rule(const struct cycles_op *before, const struct cycles_op *op)
{
    bool lr_just_written = before && ((before->writes | before->loads) >> LR & 1);
    return op->class == CYCLES_BRANCH_LR && !lr_just_written ? RULE_BRANCH_LR : RULE_BRANCH_REGISTER;
}

static bool is_long_product(const struct cycles_op *op)
{
    return op && (op->class == CYCLES_LONG_MUL || op->class == CYCLES_LONG_MLA);
}

struct cycles_count cycles_price(const struct cycles_step *s, const struct cycles_place *p)
{
    const struct cycles_op *op = s->op, *before = p->before->op;
    struct cycles_count cost = {0, 0};
    if (s->skipped || (cycles_touch_memory(op) && !s->accessed)) {
        add_rule(&cost, RULE_SKIPPED);
        return cost;
    }
    switch (op->class) {
    case CYCLES_DATA:
        add_rule(&cost, RULE_DATA);
        break;
    case CYCLES_MLA:
        add_rule(&cost, is_long_product(before) ? RULE_MLA_AFTER_LONG : RULE_MLA);
        break;
    case CYCLES_MLS:
        add_rule(&cost, RULE_MLS);
        break;
    case CYCLES_LONG_MUL:
    case CYCLES_LONG_MLA:
    case CYCLES_DIVIDE:
        cost = s->by_operands;
        break;
    case CYCLES_BRANCH:
    case CYCLES_COMPARE_BRANCH:
        add_rule(&cost, branch_rule(op, p->next, p->interrupted));
        break;
    case CYCLES_BRANCH_LR:
    case CYCLES_BRANCH_REGISTER:
        if (!s->returns) {
            add_rule(&cost, register_branch_rule(before, op));
        }
        break;
    case CYCLES_IT:
        add_rule(&cost, before && before->size == 2 ? RULE_IT_FOLDED : RULE_IT);
        break;
    case CYCLES_BARRIER:
        add_rule(&cost, RULE_BARRIER);
        add_exactly(&cost, *p->bus_free > p->spent ? *p->bus_free - p->spent : 0);
        break;
    case CYCLES_ISB:
        add_rule(&cost, RULE_ISB);
        break;
    default:
        add_memory(&cost, p, s);
        break;
    }
    return cost;
}

void cycles_price_init(const struct cycles_params *p)
{
    waits.apb_read = (unsigned)p->apb_read;
    waits.apb_write = (unsigned)p->apb_write;
    waits.ppb = (unsigned)p->ppb;
    waits.esram = (unsigned)p->esram;
    waits.envm = cycles_envm_waits(p);
}

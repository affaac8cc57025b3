/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "cycles.h"

#include <string.h>

#include "cycles_fetch.h"
#include "cycles_rules.h"

#define LR                14
#define SP                13
#define EXCEPTION_RETURNS 0xFFFFFFE0u /* EXC_RETURN values lie above */
#define IPSR_MASK         0x1FFu

enum bus { BUS_CODE, BUS_SYSTEM, BUS_PRIVATE };

/* The instruction that is being executed, or the one before it. */
struct step {
    const struct cycles_op *op;
    bool accessed, skipped, returns;
    uint32_t address;
    struct cycles_count by_operands; /* of classes whose cost depends on values */
};

static struct {
    unsigned apb_read, apb_write, ppb, esram, envm;
} waits;
static struct cycles_target target;
static struct step steps[2], *now = &steps[0], *before = &steps[1];
static bool fetch_waits;
static struct cycles_count total;
static uint64_t instructions;
static uint64_t system_bus_free; /* when the posted write is done */
static unsigned exception, nesting;
static uint16_t interrupted[64]; /* exceptions below the current one */

/* ---- small pieces ---- */

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
    case 6:
        return waits.envm;
    case 2:
        return waits.esram;
    case 0xE:
        return waits.ppb;
    default:
        return is_write ? waits.apb_write : waits.apb_read;
    }
}

static bool condition_holds(uint8_t condition, uint32_t xpsr)
{
    bool n = xpsr >> 31 & 1, z = xpsr >> 30 & 1, c = xpsr >> 29 & 1, v = xpsr >> 28 & 1;
    bool holds[8] = {z, c, n, v, c && !z, n == v, n == v && !z, true};
    return holds[condition >> 1] != (condition & 1) || condition >= CYCLES_ALWAYS;
}

/* ---- products and quotients, from the values they work on ---- */

static bool is_short(uint32_t value)
{
    return value <= 0xFFFF;
}

static struct cycles_count price_product(const struct cycles_op *op, uint32_t n, uint32_t m)
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

static struct cycles_count price_quotient(const struct cycles_op *op, uint32_t n, uint32_t d)
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

static bool touches_memory(const struct cycles_op *op)
{
    return op->is_load || op->is_store;
}

static bool pairs_with_load_before(const struct step *s)
{
    const struct cycles_op *first = before->op;
    return first && first->class == CYCLES_LOAD && before->accessed && !first->base_update && !s->op->base_update &&
           bus_of(before->address) == bus_of(s->address) && !(first->loads & s->op->address_registers);
}

static void add_neighbour(struct cycles_count *cost, const struct step *s)
{
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

static unsigned unaligned_parts(const struct step *s)
{
    const struct cycles_op *op = s->op;
    if (op->class != CYCLES_LOAD || (s->address & (op->access_bytes - 1u)) == 0) {
        return 0;
    }
    return op->access_bytes == 4 && s->address % 2 != 0 ? 2 : 1;
}

/* Wait states. A load waits for its own; the last write of a store is posted, and what comes next on the bus waits. */
static void add_bus(struct cycles_count *cost, const struct step *s, uint64_t *bus_free)
{
    const struct cycles_op *op = s->op;
    unsigned transfers = op->class == CYCLES_MULTIPLE ? op->transfers : op->class == CYCLES_DOUBLE ? 2 : 1;
    unsigned wait = wait_of(s->address, op->is_store);
    if (bus_of(s->address) != BUS_SYSTEM) {
        add_exactly(cost, (uint64_t)wait * transfers);
        return;
    }
    if (*bus_free > total.high) {
        add_exactly(cost, *bus_free - total.high);
    }
    if (op->is_store && !op->is_load) {
        add_exactly(cost, (uint64_t)wait * (transfers - 1));
        *bus_free = total.high + cost->high + wait;
    } else {
        add_exactly(cost, (uint64_t)wait * transfers);
    }
}

static void add_memory(struct cycles_count *cost, const struct step *s, uint64_t *bus_free)
{
    const struct cycles_op *op = s->op;
    bool paired = pairs_with_load_before(s);
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
    add_neighbour(cost, s);
    add_bus(cost, s, bus_free);
}

/* ---- one instruction ---- */

static enum cycles_rule branch_rule(const struct cycles_op *op, const struct cycles_op *next, bool interrupted_here)
{
    bool compares = op->class == CYCLES_COMPARE_BRANCH,
         may_fall_through = op->conditional || compares || op->condition != CYCLES_ALWAYS;
    if (may_fall_through && interrupted_here) {
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

static enum cycles_rule register_branch_rule(const struct cycles_op *op)
{
    bool lr_just_written = before->op && ((before->op->writes | before->op->loads) >> LR & 1);
    return op->class == CYCLES_BRANCH_LR && !lr_just_written ? RULE_BRANCH_LR : RULE_BRANCH_REGISTER;
}

static bool after_long_product(void)
{
    return before->op && (before->op->class == CYCLES_LONG_MUL || before->op->class == CYCLES_LONG_MLA);
}

/* `next` is NULL where the instruction is a load that has not ended yet. */
static struct cycles_count price(const struct step *s, const struct cycles_op *next, bool interrupted_here,
                                 uint64_t *bus_free)
{
    const struct cycles_op *op = s->op;
    struct cycles_count cost = {0, 0};
    if (s->skipped || (touches_memory(op) && !s->accessed)) {
        add_rule(&cost, RULE_SKIPPED);
        return cost;
    }
    switch (op->class) {
    case CYCLES_DATA:
        add_rule(&cost, RULE_DATA);
        break;
    case CYCLES_MLA:
        add_rule(&cost, after_long_product() ? RULE_MLA_AFTER_LONG : RULE_MLA);
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
        add_rule(&cost, branch_rule(op, next, interrupted_here));
        break;
    case CYCLES_BRANCH_LR:
    case CYCLES_BRANCH_REGISTER:
        if (!s->returns) {
            add_rule(&cost, register_branch_rule(op));
        }
        break;
    case CYCLES_IT:
        add_rule(&cost, before->op && before->op->size == 2 ? RULE_IT_FOLDED : RULE_IT);
        break;
    case CYCLES_BARRIER:
        add_rule(&cost, RULE_BARRIER);
        add_exactly(&cost, *bus_free > total.high ? *bus_free - total.high : 0);
        break;
    case CYCLES_ISB:
        add_rule(&cost, RULE_ISB);
        break;
    default:
        add_memory(&cost, s, bus_free);
        break;
    }
    return cost;
}

/* ---- the flow ---- */

static void spend(enum cycles_rule rule)
{
    add_rule(&total, rule);
}

static void enter(unsigned number, enum cycles_rule rule)
{
    spend(rule);
    interrupted[nesting % 64] = (uint16_t)exception;
    nesting++;
    exception = number;
    before->op = NULL;
    target.entered(number, cycles_rules[rule].high);
}

static void leave(bool tail_chained)
{
    if (!tail_chained) {
        spend(RULE_EXCEPTION_EXIT);
    }
    target.returned(tail_chained);
    if (nesting > 0) {
        nesting--;
    }
    exception = interrupted[nesting % 64];
    before->op = NULL;
}

/* Exceptions show in IPSR, and only where a handler starts or an EXC_RETURN was executed: elsewhere it is not read. */
static bool exception_changes(const struct cycles_op *op)
{
    bool returned = before->returns;
    if (!returned && !op->starts_handler) {
        return false;
    }
    unsigned number = target.read_xpsr() & IPSR_MASK;
    unsigned below = nesting > 0 ? interrupted[(nesting - 1) % 64] : 0;
    if (returned) {
        bool chained = op->starts_handler && number != 0 && number != below;
        leave(chained);
        if (chained) {
            enter(number, RULE_TAIL_CHAIN);
        }
        return true;
    }
    if (number != 0 && number != exception) {
        enter(number, RULE_EXCEPTION_ENTRY);
        return true;
    }
    return false;
}

static bool goes_elsewhere(const struct cycles_op *op, const struct cycles_op *next)
{
    return next->address != op->address + op->size || op->class == CYCLES_BRANCH_REGISTER ||
           (op->class == CYCLES_BRANCH && !op->conditional && op->condition == CYCLES_ALWAYS);
}

/* What was being executed is now the instruction before. */
static void pass_on(void)
{
    struct step *done = now;
    now = before;
    before = done;
}

static void settle(const struct cycles_op *next)
{
    const struct cycles_op *op = now->op;
    bool arrives = next->starts_handler && (target.read_xpsr() & IPSR_MASK) != exception;
    struct cycles_count cost = price(now, next, arrives, &system_bus_free);
    total.low += cost.low;
    total.high += cost.high;
    pass_on();
    bool restarts = exception_changes(next) || goes_elsewhere(op, next);
    if (restarts && next->size == 4 && next->address % 4 != 0) {
        spend(RULE_TARGET_SPLIT);
    }
    if (fetch_waits) {
        add_exactly(&total, (restarts ? cycles_fetch_restart : cycles_fetch)(next->address, next->size, total.high));
    }
}

static uint32_t loaded_pc(const struct cycles_op *op)
{
    return target.read_word(target.read_register(SP) + 4u * (op->transfers - 1u));
}

/* EXC_RETURN in the PC ends a handler; only a handler can do that. */
static bool is_exception_return(const struct cycles_op *op)
{
    if (exception == 0) {
        return false;
    }
    if (op->class == CYCLES_BRANCH_LR) {
        return target.read_register(LR) >= EXCEPTION_RETURNS;
    }
    return op->pops_pc && op->address_registers == 1u << SP && loaded_pc(op) >= EXCEPTION_RETURNS;
}

static void look_at_registers(const struct cycles_op *op)
{
    if (op->condition != CYCLES_ALWAYS && !condition_holds(op->condition, target.read_xpsr())) {
        now->skipped = true;
        return;
    }
    if (op->class == CYCLES_DIVIDE) {
        now->by_operands = price_quotient(op, target.read_register(op->n), target.read_register(op->m));
    } else if (op->class == CYCLES_LONG_MUL || op->class == CYCLES_LONG_MLA) {
        now->by_operands = price_product(op, target.read_register(op->n), target.read_register(op->m));
    } else {
        now->returns = is_exception_return(op);
    }
}

static bool depends_on_registers(const struct cycles_op *op)
{
    static const bool always[CYCLES_CLASSES] = {
        [CYCLES_LONG_MUL] = true, [CYCLES_LONG_MLA] = true, [CYCLES_DIVIDE] = true, [CYCLES_BRANCH_LR] = true};
    return always[op->class] || op->pops_pc ||
           (op->condition != CYCLES_ALWAYS && (op->class == CYCLES_MLA || op->class == CYCLES_MLS));
}

bool cycles_wants_registers(const struct cycles_op *op)
{
    return depends_on_registers(op) || op->starts_handler;
}

bool cycles_wants_address(const struct cycles_op *op)
{
    return touches_memory(op);
}

bool cycles_wants_each(void)
{
    return fetch_waits;
}

static void begin(const struct cycles_op *op)
{
    now->op = op;
    now->accessed = now->skipped = now->returns = false;
}

/* All but the last instruction of a run are done, and cost what their class costs. */
static void run_through(const struct cycles_run *run)
{
    instructions += run->count - 1;
    total.low += (uint64_t)cycles_rules[RULE_DATA].low * (run->count - 1);
    total.high += (uint64_t)cycles_rules[RULE_DATA].high * (run->count - 1);
    now->op = run->last_but_one;
    pass_on();
    begin(run->last);
}

void cycles_execute(const struct cycles_op *op)
{
    instructions++;
    const struct cycles_op *done = now->op;
    if (done && done->class == CYCLES_DATA && op->address == done->address + done->size && !op->starts_handler &&
        !fetch_waits) {
        spend(RULE_DATA); /* most of all instructions: worth a short way */
        pass_on();
    } else if (done) {
        settle(op);
    }
    begin(op);
    if (op->run) {
        run_through(op->run);
    } else if (depends_on_registers(op)) {
        look_at_registers(op);
    }
}

void cycles_access(uint32_t address)
{
    if (!now->accessed) {
        now->accessed = true;
        now->address = address;
    }
}

struct cycles_count cycles_total(void)
{
    return total;
}

uint64_t cycles_instructions(void)
{
    return instructions;
}

uint64_t cycles_sampled(uint32_t address)
{
    if (!now->op || !touches_memory(now->op)) {
        return total.high; /* read by the debugger */
    }
    struct step reading = *now;
    reading.accessed = true;
    reading.address = address;
    uint64_t bus_free = system_bus_free;
    return total.high + price(&reading, NULL, false, &bus_free).high - 1;
}

void cycles_reset(void)
{
    memset(steps, 0, sizeof steps);
    exception = 0;
    nesting = 0;
    system_bus_free = 0;
}

void cycles_init(const struct cycles_params *p, const struct cycles_target *t)
{
    waits.apb_read = (unsigned)p->apb_read;
    waits.apb_write = (unsigned)p->apb_write;
    waits.ppb = (unsigned)p->ppb;
    waits.esram = (unsigned)p->esram;
    waits.envm = p->cache != 0 ? 0 : (unsigned)p->envm_wait;
    cycles_fetch_init(waits.envm, waits.esram);
    fetch_waits = waits.envm != 0 || waits.esram != 0;
    target = *t;
    cycles_reset();
}

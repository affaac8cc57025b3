/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "cycles.h"

#include <string.h>

#include "cycles_cache.h"
#include "cycles_fetch.h"
#include "cycles_price.h"
#include "cycles_rules.h"

#define LR                14
#define SP                13
#define EXCEPTION_RETURNS 0xFFFFFFE0u /* EXC_RETURN values lie above */
#define IPSR_MASK         0x1FFu
#define SYSTEM_BUS        0x20000000u /* from here on */
#define FRAME_WORDS       8u

static struct cycles_target target;
static struct cycles_step steps[2], *now = &steps[0], *before = &steps[1];
static bool envm_waits, enters_cold;
static uint64_t exit_beyond_rule;             /* modulo 2^64 */
static unsigned vector_on_stacks_bus, popped; /* cycles beyond those of an entry and an exit */
static struct cycles_count total;
static uint64_t instructions;
static uint64_t system_bus_free; /* when the posted write is done */
static unsigned exception, nesting;
static uint16_t interrupted[64]; /* exceptions below the current one */

/* ---- small pieces ---- */

static bool condition_holds(uint8_t condition, uint32_t xpsr)
{
    bool n = xpsr >> 31 & 1, z = xpsr >> 30 & 1, c = xpsr >> 29 & 1, v = xpsr >> 28 & 1;
    bool holds[8] = {z, c, n, v, c && !z, n == v, n == v && !z, true};
    return holds[condition >> 1] != (condition & 1) || condition >= CYCLES_ALWAYS;
}

/* ---- the flow ---- */

static void spend(enum cycles_rule rule)
{
    total.low += cycles_rules[rule].low;
    total.high += cycles_rules[rule].high;
}

static void spend_exactly(uint64_t cycles)
{
    total.low += cycles;
    total.high += cycles;
}

/* The frame is pushed over the system bus, and the vector is read at the same time only if that goes over another. */
static unsigned beyond_entry(enum cycles_rule rule)
{
    return rule == RULE_EXCEPTION_ENTRY && target.vectors() >= SYSTEM_BUS ? vector_on_stacks_bus : 0;
}

static void enter(unsigned number, enum cycles_rule rule)
{
    const unsigned beyond = beyond_entry(rule);
    if (enters_cold) {
        cycles_cache_evict();
    }
    spend(rule);
    spend_exactly(beyond);
    interrupted[nesting % 64] = (uint16_t)exception;
    nesting++;
    exception = number;
    before->op = NULL;
    target.entered(number, cycles_rules[rule].high + beyond);
}

static void leave(bool tail_chained)
{
    if (!tail_chained) {
        spend(RULE_EXCEPTION_EXIT);
        spend_exactly(exit_beyond_rule + popped);
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
    struct cycles_step *done = now;
    now = before;
    before = done;
}

/* Code in eSRAM does in each case. */
static bool may_come_late(const struct cycles_op *op)
{
    return envm_waits || op->address >= SYSTEM_BUS;
}

/* Whether the instruction before has used the bus that eSRAM's code comes over. */
static bool done_on_system_bus(void)
{
    return before->op && before->accessed && before->address >= SYSTEM_BUS && before->address >> 20 != 0xE00;
}

static void settle(const struct cycles_op *next)
{
    const struct cycles_op *op = now->op;
    bool arrives = next->starts_handler && (target.read_xpsr() & IPSR_MASK) != exception;
    struct cycles_place place = {before, next, arrives, total.high, &system_bus_free};
    struct cycles_count cost = cycles_price(now, &place);
    total.low += cost.low;
    total.high += cost.high;
    pass_on();
    bool restarts = exception_changes(next) || goes_elsewhere(op, next);
    if (restarts && next->size == 4 && next->address % 4 != 0) {
        spend(RULE_TARGET_SPLIT);
    }
    if (may_come_late(next)) {
        if (done_on_system_bus()) {
            cycles_fetch_give_way(cost.high);
        }
        spend_exactly((restarts ? cycles_fetch_restart : cycles_fetch)(next->address, next->size, total.high));
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
        now->by_operands = cycles_price_quotient(op, target.read_register(op->n), target.read_register(op->m));
    } else if (op->class == CYCLES_LONG_MUL || op->class == CYCLES_LONG_MLA) {
        now->by_operands = cycles_price_product(op, target.read_register(op->n), target.read_register(op->m));
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
    return cycles_touch_memory(op);
}

bool cycles_accesses_once(const struct cycles_op *op)
{
    bool exclusive = op->is_load && op->is_store; /* QEMU compares and exchanges */
    return (op->class == CYCLES_LOAD || op->class == CYCLES_STORE) && !exclusive && op->condition == CYCLES_ALWAYS;
}

static void begin(const struct cycles_op *op)
{
    now->op = op;
    now->accessed = now->skipped = now->returns = false;
}

static void go_on(const struct cycles_op *op)
{
    const struct cycles_op *done = now->op;
    instructions++;
    if (done && done->class == CYCLES_DATA && op->address == done->address + done->size && !op->starts_handler) {
        spend(RULE_DATA); /* most of all instructions: worth a short way */
        pass_on();
        if (may_come_late(op)) {
            spend_exactly(cycles_fetch(op->address, op->size, total.high));
        }
    } else if (done) {
        settle(op);
    } else if (may_come_late(op)) { /* behind a reset: what the core had fetched ahead is gone */
        spend_exactly(cycles_fetch_restart(op->address, op->size, total.high));
    }
    begin(op);
}

void cycles_execute(const struct cycles_op *op)
{
    go_on(op);
    if (depends_on_registers(op)) {
        look_at_registers(op);
    }
    for (unsigned left = op->count; left > 1; left--) {
        op = op->next;
        go_on(op);
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
    if (!now->op || !cycles_touch_memory(now->op)) {
        return total.high; /* read by the debugger */
    }
    struct cycles_step reading = *now;
    reading.accessed = true;
    reading.address = address;
    uint64_t bus_free = system_bus_free;
    struct cycles_place place = {before, NULL, false, total.high, &bus_free};
    return total.high + cycles_price(&reading, &place).high - 1;
}

void cycles_reset(void)
{
    memset(steps, 0, sizeof steps);
    exception = 0;
    nesting = 0;
    system_bus_free = 0;
    cycles_cache_reset();
}

void cycles_init(const struct cycles_params *p, const struct cycles_target *t)
{
    cycles_price_init(p);
    cycles_cache_init(p);
    exit_beyond_rule = (uint64_t)p->exit - cycles_rules[RULE_EXCEPTION_EXIT].high;
    vector_on_stacks_bus = (unsigned)p->vector + (unsigned)p->esram;
    enters_cold = p->cold != 0;
    popped = FRAME_WORDS * (unsigned)p->esram;
    envm_waits = cycles_envm_waits(p) != 0;
    cycles_fetch_init(envm_waits, (unsigned)p->esram);
    target = *t;
    cycles_reset();
}

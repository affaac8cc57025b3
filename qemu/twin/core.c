/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "core.h"

#include "cycles.h"
#include "cycles_table.h"
#include "dwt.h"
#include "envm_board.h"
#include "irqlog.h"
#include "irqpath.h"
#include "qemu_api.h"
#include "reach.h"

#define VTOR               0xE000ED08u
#define NS_PER_INSTRUCTION 8 /* -icount shift=3 */
#define NS_PER_CYCLE       10
#define PACE_NS            1000 /* simulated time falls behind so far, and then catches up */

static bool each_by_itself; /* instructions are not announced in runs */
static bool time_by_cycles;
static bool vectors_known;
static int64_t caught_up_ns;

static struct vm_instruction translated(uint32_t address)
{
    const struct cycles_op *op = cycles_lookup(address, vm_read_memory);
    reach_note(address);
    return (struct vm_instruction){op, cycles_wants_registers(op), cycles_wants_address(op), cycles_accesses_once(op)};
}

static const void *joined(const void *piece, const void *next)
{
    return each_by_itself ? NULL : cycles_join(piece, next);
}

static void caught_up(int64_t by_ns)
{
    caught_up_ns += by_ns;
}

/* QEMU's time goes by instructions: the core stands still until it is that of the cycles. In sleep neither is counted. */
static void keep_pace(void)
{
    int64_t behind_ns = (int64_t)cycles_total().high * NS_PER_CYCLE -
                        (int64_t)cycles_instructions() * NS_PER_INSTRUCTION - caught_up_ns;
    if (time_by_cycles && behind_ns >= PACE_NS) {
        vm_stall(vm_executing_ns() + behind_ns, caught_up);
    }
}

static void executing(const void *op)
{
    const uint32_t address = ((const struct cycles_op *)op)->address;
    cycles_execute(op);
    if (each_by_itself) {
        irqpath_executing(address);
        keep_pace();
    }
    if (envm_board_busy) {
        envm_board_waits(address);
    }
}

static void accessed(uint32_t address, const void *next)
{
    cycles_access(address);
    vectors_known = vectors_known && address != VTOR;
    if (envm_board_busy) {
        envm_board_waits(address);
    }
    if (next) {
        executing(next);
    }
}

static uint32_t register_of(unsigned number)
{
    return vm_register((int)number);
}

static uint32_t program_status(void)
{
    return vm_register(VM_XPSR);
}

static uint32_t memory_word(uint32_t address)
{
    uint32_t word;
    vm_read_memory(address, &word, sizeof word);
    return word;
}

static sim_ps executing_at(void)
{
    return vm_executing_ns() * SIM_PS_PER_NS;
}

static void exception_entered(unsigned exception, unsigned entry_cycles)
{
    irqlog_entered(exception, entry_cycles);
    irqpath_entered(exception, entry_cycles, sim_to_s(executing_at()));
}

static void exception_returned(bool tail_chained)
{
    irqlog_returned(tail_chained);
    irqpath_returned();
}

/* QEMU finds the core and its kind by name for this: only once it may have changed. */
static uint32_t vectors(void)
{
    static uint32_t table;
    if (!vectors_known) {
        vm_read_core(VTOR, &table, sizeof table);
        vectors_known = true;
    }
    return table;
}

void core_watch(uint64_t plugin_id, const struct config *config)
{
    static const struct vm_instructions hooks = {translated, joined, executing, accessed};
    static const struct cycles_target core = {register_of,       program_status,     memory_word,
                                              exception_entered, exception_returned, vectors};
    if (config->irqlog_path) {
        irqlog_open(config->irqlog_path, executing_at);
    }
    if (config->irqpath_path) {
        irqpath_open(config->irqpath_path, config->irqpath_exception);
    }
    reach_open();
    cycles_init(&config->cycles, &core);
    time_by_cycles = config->time_by_cycles;
    each_by_itself = config->irqpath_path || time_by_cycles;
    vm_on_instructions(plugin_id, &hooks);
}

uint64_t core_cycles(void)
{
    return cycles_sampled(DWT_BASE);
}

void core_reset(void)
{
    vectors_known = false;
    cycles_reset();
    irqlog_reset();
    irqpath_reset();
}

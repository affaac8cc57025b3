/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The core's clock cycles, added up as instructions are executed. docs/timing.md says what is modelled and what is not.
 * Knows nothing of QEMU: registers and memory are asked for through struct cycles_target.
 *
 * An instruction's cost depends on the one before (pairing) and on where execution goes on (branches), so it is known
 * when the next one begins: totals are complete up to, not including, the instruction last announced. */
#ifndef TWIN_CYCLES_H
#define TWIN_CYCLES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "cycles_decode.h"
#include "keys.h"

enum cycles_cache {
    CYCLES_CACHE_OFF,    /* every fetch and read of eNVM waits */
    CYCLES_CACHE_HITS,   /* none does */
    CYCLES_CACHE_DEVICE, /* cycles_cache.h */
};

/* Extra cycles over a bus that answers at once; whole numbers. */
struct cycles_params {
    double apb_read, apb_write; /* fabric behind FIC and MSS peripherals; a write is posted through one buffer */
    double ppb;                 /* private peripheral bus: NVIC, SysTick, DWT */
    double esram;               /* a read, of data and of code: the register in its read path */
    double envm_wait;           /* fetch and data that the cache does not serve */
    double cache;               /* enum cycles_cache */
    double cache_miss;          /* a line that the device's cache does not have */
    double exit;                /* of an exception, in place of the rule's; the eight words it pops wait besides */
    double cold;                /* 1: an exception's entry finds the cache empty, unless it is locked */
    double vector;              /* more of an entry whose vector lies on the stack's bus; its own wait besides */
};

extern const struct config_key cycles_keys[];

struct cycles_count {
    uint64_t low, high;
};

struct cycles_target {
    uint32_t (*read_register)(unsigned number); /* 0...15 */
    uint32_t (*read_xpsr)(void);
    uint32_t (*read_word)(uint32_t address);
    /* Called when an exception's first instruction is reached, its entry already added; and on return, exit added. */
    void (*entered)(unsigned exception, unsigned entry_cycles);
    void (*returned)(bool tail_chained);
    uint32_t (*vectors)(void); /* where the vector table lies */
};

void cycles_init(const struct cycles_params *params, const struct cycles_target *target);
/* After a reset of the core. The totals go on. */
void cycles_reset(void);

/* Does the model want the registers as they are just before this instruction, and the addresses it accesses? */
bool cycles_wants_registers(const struct cycles_op *op);
bool cycles_wants_address(const struct cycles_op *op);

/* Does it access memory once, and never not? */
bool cycles_accesses_once(const struct cycles_op *op);

/* Before the instruction, or the run, executes. `op` must stay. */
void cycles_execute(const struct cycles_op *op);
/* It accessed memory; of several accesses the first counts. */
void cycles_access(uint32_t address);

/* Complete up to, not including, the current instruction. */
struct cycles_count cycles_total(void);
uint64_t cycles_instructions(void); /* executed, including the current one */

/* The count that a load of CYCCNT, which is the current instruction, finds: as of the last cycle of the load. */
uint64_t cycles_sampled(uint32_t address);

#endif

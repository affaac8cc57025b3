/* SPDX-License-Identifier: MIT */
/* What firmware/system and the device lean on. Their registers stand at their addresses, in memory that a test has mapped. */
#include "drivers/cortex/cpu.h"
#include "drivers/cortex/dwt.h"
#include "firmware/system/handlers.h"
#include "startup/startup.h"

uint32_t host_primask, host_basepri, host_sleeps;
void (*host_on_sleep)(void);
void (*host_on_mask)(uint32_t level);

uint32_t host_exception;
uint32_t host_current_loops; /* runs of the handler in assembly */
uint32_t host_scoped_ticks;  /* runs of the entry in front of it */
uint32_t (*host_on_cycles)(void);

void (*startup_vectors[STARTUP_SYSTEM_VECTORS + STARTUP_EXTERNAL_VECTORS])(void);

/* The guard of the stack: aligned to its size, the stack above it. */
uint32_t link_stack_guard_start[64] __attribute__((aligned(256)));
__asm__(".globl link_stack_limit\n.set link_stack_limit, link_stack_guard_start + 256");

/* The memory that the scope may read. */
uint32_t link_data_start[64];
__asm__(".globl link_ram_end\n.set link_ram_end, link_data_start + 256");

/* What a lock of the cache copies, and compares. */
const uint32_t link_code[2048], link_array[2048];

uint32_t startup_exception_number(void)
{
    return host_exception;
}

uint32_t dwt_cycles(void)
{
    return host_on_cycles();
}

void FabricIrq0_IRQHandler(void)
{
    host_current_loops++;
}

void FabricIrq1_IRQHandler(void)
{
    host_current_loops++;
}

void scoped_tick(void)
{
    host_scoped_ticks++;
}

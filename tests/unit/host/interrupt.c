/* SPDX-License-Identifier: MIT */
/*
 * Lets a test interrupt the firmware between any two basic blocks: the compiler calls this hook at the head of each
 * (-fsanitize-coverage=trace-pc). The interrupt comes once, at the block whose number was asked for, or at the first behind it
 * at which interrupts are not masked. At each block the hook also looks at two words that must never be set together.
 */
#include "drivers/cortex/cpu.h"

void (*host_interrupt)(void); /* NULL: none */
uint64_t host_interrupt_at;   /* the number of the block */
uint64_t host_blocks;         /* passed so far */

const volatile uint32_t *host_exclusive[2]; /* NULL: nothing is looked at */
uint64_t host_first_set_at;                 /* the block at which the first word was set for the first time; 0: never */
uint64_t host_both_set;                     /* blocks at which both were */

__attribute__((no_sanitize_coverage)) void __sanitizer_cov_trace_pc(void);

void __sanitizer_cov_trace_pc(void)
{
    void (*const taken)(void) = host_interrupt;
    host_blocks++;
    if (host_exclusive[0] != 0 && *host_exclusive[0] != 0u) {
        host_first_set_at = host_first_set_at == 0u ? host_blocks : host_first_set_at;
        host_both_set += *host_exclusive[1] != 0u ? 1u : 0u;
    }
    if (taken != 0 && host_blocks >= host_interrupt_at && host_primask == 0u) {
        host_interrupt = 0;
        taken();
    }
}

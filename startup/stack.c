/* SPDX-License-Identifier: MIT */
/*
 * How deep the main stack ever went.
 */
#include "startup/startup.h"

size_t startup_stack_unused_bytes(void)
{
    const volatile uint32_t *word = link_stack_limit;
    while (word < link_stack_top && *word == STARTUP_STACK_PAINT) {
        word++;
    }
    return (size_t)((uintptr_t)word - (uintptr_t)link_stack_limit);
}

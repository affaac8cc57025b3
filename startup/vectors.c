/* SPDX-License-Identifier: MIT */
/*
 * The vector table: 16 vectors of the core and the 82 interrupts of the device. The one in flash is for reset, and is copied
 * to eSRAM there: so vectors can change, and taking an interrupt never waits for the flash.
 */
#include "startup/startup.h"

/* Every name without an owner ends here: an interrupt nobody handles is a fault, and its number is in IPSR. */
__attribute__((naked, used)) static void unhandled(void)
{
    __asm volatile("b fault_entry");
}

#define WEAK_HANDLER(number, handler) void handler(void) __attribute__((weak, alias("unhandled")));
STARTUP_FAULT_HANDLERS(WEAK_HANDLER)
STARTUP_SYSTEM_HANDLERS(WEAK_HANDLER)
STARTUP_EXTERNAL_HANDLERS(WEAK_HANDLER)

typedef void (*vector_t)(void);

struct vector_table {
    const uint32_t *initial_stack;
    vector_t system[STARTUP_SYSTEM_VECTORS - 1u];
    vector_t external[STARTUP_EXTERNAL_VECTORS];
};

_Static_assert(sizeof(struct vector_table) == 4u * (STARTUP_SYSTEM_VECTORS + STARTUP_EXTERNAL_VECTORS), "98 words");

/* The formatter takes lists that expand to designated initialisers for code. */
/* clang-format off */
#define SYSTEM_VECTOR(number, handler) [(number) - 1] = handler,
#define EXTERNAL_VECTOR(number, handler) [number] = handler,

extern const struct vector_table vectors;

__attribute__((section(".vectors"), used)) const struct vector_table vectors = {
    .initial_stack = link_stack_top,
    .system = {
        [0] = Reset_Handler,
        STARTUP_FAULT_HANDLERS(SYSTEM_VECTOR)
        STARTUP_SYSTEM_HANDLERS(SYSTEM_VECTOR)
    },
    .external = { STARTUP_EXTERNAL_HANDLERS(EXTERNAL_VECTOR) },
};
/* clang-format on */

vector_t startup_vectors[STARTUP_SYSTEM_VECTORS + STARTUP_EXTERNAL_VECTORS]
    __attribute__((section(".vectors_in_use"), used));

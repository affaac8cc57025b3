/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Lets the thread that executes the guest sleep through WFI by itself. QEMU would hand over to its main loop, which
 * moves the clock on, and back again: two switches of threads for each WFI, which cost more than all the rest. */
#ifndef TWIN_QEMU_SLEEP_H
#define TWIN_QEMU_SLEEP_H

#include <stdbool.h>
#include <stdint.h>

/* Before the guest executes. False if this QEMU keeps its clock in a way that is not known here: all goes on as QEMU
 * would do it by itself, with the same results. */
bool vm_sleep_prepare(void);
/* The core is about to execute a WFI, and all instructions up to it are booked. */
void vm_sleep_ahead(void *cpu);
/* The core stands still until then, or until a reset is due, from the end of this block of instructions on; `over` is told for
 * how long it was. Once is enough, and each of two functions `over` has its own. False as prepare(). */
bool vm_stall_core(void *cpu, int64_t until_ns, const bool *reset_is_due, void (*over)(int64_t for_ns));

#endif

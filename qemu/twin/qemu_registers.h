/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Makes the guest's registers true in a callback before an instruction, where QEMU does not offer that. */
#ifndef TWIN_QEMU_REGISTERS_H
#define TWIN_QEMU_REGISTERS_H

#include <stdbool.h>

/*
 * QEMU 9 and later write the registers back before a callback that asked for them. Before, callbacks are said to need no
 * registers whatever they asked for, in QEMU's table of helper functions; this corrects the table's row. Returns false
 * if it is not found as 7.2 has it: registers are then true at the start of a block only. Call it before any block is
 * translated.
 */
bool vm_make_callbacks_read_registers(void);

#endif

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Decoded instructions, each kept once for the whole run. */
#ifndef TWIN_CYCLES_TABLE_H
#define TWIN_CYCLES_TABLE_H

#include <stddef.h>

#include "cycles_decode.h"

/* The instruction at this address as memory holds it now. `read` copies target memory; the vector table is looked for at
 * address 0 and is read once, at the first call. */
const struct cycles_op *cycles_lookup(uint32_t address, void (*read)(uint32_t address, void *bytes, size_t length));

#endif

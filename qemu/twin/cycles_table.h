/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Decoded instructions, each kept once for the whole run. */
#ifndef TWIN_CYCLES_TABLE_H
#define TWIN_CYCLES_TABLE_H

#include <stddef.h>

#include "cycles_decode.h"

/* The instruction at this address as memory holds it now. `read` copies target memory; whether a vector points
 * there is looked up at the first call for it: a handler must be in its vector before its code is executed. */
const struct cycles_op *cycles_lookup(uint32_t address, void (*read)(uint32_t address, void *bytes, size_t length));

/* An instruction or a run of them, and the next in one translated block, as one run; NULL where they are not. */
const struct cycles_op *cycles_join(const struct cycles_op *piece, const struct cycles_op *next);

#endif

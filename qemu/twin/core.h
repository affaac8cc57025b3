/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The processor as it executes: its instructions become cycles, its exceptions the logs. */
#ifndef TWIN_CORE_H
#define TWIN_CORE_H

#include "config.h"

/* Opens the logs and listens to the core. Before it exists, once. */
void core_watch(uint64_t plugin_id, const struct config *config);

/* The count that a load of CYCCNT, which is the current instruction, finds. */
uint64_t core_cycles(void);

/* After a reset of the core. */
void core_reset(void);

#endif

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The axes of the fabric: of each its plant, its interrupt line, what wakes it in time, and what is recorded of it. They share
 * nothing but simulated time, the fabric's resets, and the carrier of axis 0, which others may follow. */
#ifndef TWIN_AXES_H
#define TWIN_AXES_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "config.h"
#include "plant.h"
#include "simtime.h"

#define AXES_FABRIC_BASE 0x50000000u

/* Makes the plants and opens their outputs; what cannot be opened ends the process with one line. `config` must stay. */
void axes_init(const struct config *config);
/* When timers may be used. */
void axes_start(void);
struct plant *axes_plant(unsigned axis);

/* Registers, by offset from AXES_FABRIC_BASE. Where no axis is, a read gives 0. */
uint32_t axes_read(uint32_t offset);
void axes_write(uint32_t offset, uint32_t value);

/* Brings all plants to the present; afterwards, whoever changed something says so. */
void axes_sync(void);
void axes_changed(void);
/* All blocks of all axes; the physics goes on. To be called when the plants are at the present. */
void axes_reset_fabric(void);
/* QEMU no longer knows the levels of the lines: axes_changed() is to tell it. */
void axes_forget_lines(void);

/* FabricIrq of an axis: the next one comes later; none comes. */
void axes_delay_interrupt(unsigned axis, sim_ps delay);
void axes_block_interrupt(unsigned axis, bool blocked);

/* How far it is and what the motors do, as one line. */
void axes_report(FILE *progress);
/* The last rows are written with what the probes read now. */
void axes_complete_rows(void);
/* Everything so far reaches its files. Safe in a signal handler. */
void axes_flush(void);

#endif

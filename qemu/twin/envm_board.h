/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The eNVM's controller on the board: its registers on the bus, the array that the core reads and executes, the time for which
 * an access to it waits, and the file that stands for what a device keeps while it is off. */
#ifndef TWIN_ENVM_BOARD_H
#define TWIN_ENVM_BOARD_H

#include "envm.h"

/* At attachment. `cut` ends this life of the device. */
void envm_board_map(const struct envm_params *p, uint64_t seed, void (*cut)(void));
/* Before the first instruction: the file's pages are in the array. `path` is NULL if nothing is kept. */
void envm_board_start(const char *path);

/* An instruction is about to be fetched from there, or data were read: it waits if a command is under way. */
extern bool envm_board_busy;
void envm_board_waits(uint32_t address);

void envm_board_power_cut(void);
void envm_board_reset(void);
/* To the file. */
void envm_board_keep(void);

#endif

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Which code was ever executed: TWIN_REACH=FILE in the environment. `make mutants` asks for it.
 *
 * A bit for each halfword of code, that of address 0 first, in REACH_BYTES: the eNVM's first 512 KiB, then eSRAM's. Runs add
 * their bits to what the file has, also when they are killed. */
#ifndef TWIN_REACH_H
#define TWIN_REACH_H

#include <stdint.h>

#define REACH_SPAN  0x80000u
#define REACH_BYTES (2u * REACH_SPAN / 2u / 8u)

/* Opens the file, if there is to be one; ends the process with one line if it can't. */
void reach_open(void);

/* The instruction at this address is about to be executed for the first time. */
void reach_note(uint32_t address);

#endif

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A CSV file with the way through one exception's handler, once for each duration that it had:
 *
 *   cycles            the duration: entry to return, both included
 *   t_s               when an interrupt first took that long
 *   address           of an instruction, in the order of execution
 *   instruction_cycles  until the next one began; the last one's include the return
 *
 * So what makes two interrupts differ can be read by name. Interrupts that were interrupted themselves are left out. */
#ifndef TWIN_IRQPATH_H
#define TWIN_IRQPATH_H

#include <stdint.h>

/* A file that cannot be written ends the process. Without it, the other calls do nothing. */
void irqpath_open(const char *path, unsigned exception);
void irqpath_entered(unsigned exception, unsigned entry_cycles, double t_s);
void irqpath_executing(uint32_t address);
void irqpath_returned(void);
void irqpath_reset(void);

#endif

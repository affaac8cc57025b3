/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A recording (recording.h) with one row for each exception that was taken and has returned, in the order of return:
 *
 *   t_s               when its line rose; for an exception without a line that the twin drives, when it was taken
 *   exception         its number (IRQ n is 16 + n)
 *   start_ns          from the rise to the handler's first instruction, entry included; 0 without such a line
 *   start_pwm_ns      the same from the start of the PWM period
 *   cycles            entry to return, both included, without what other exceptions took in between
 *   instructions      likewise
 *   latency_cycles    entry to the last write of the PWM's COMPARE_C, both included; 0 if there was none
 *   preempted_cycles  what other exceptions took in between
 *   cycles_low        lower bound of `cycles`, which is the upper
 *   chained           b0: entered by tail-chaining (6 cycles in place of an entry's); b1: left so (none of an exit's)
 *
 * ns of core clocks of 10 ns, docs/fabric.md. */
#ifndef TWIN_IRQLOG_H
#define TWIN_IRQLOG_H

#include <stdbool.h>
#include <stdint.h>

#include "simtime.h"

/* A file that cannot be written ends the process. Without it, the other calls do nothing. */
void irqlog_open(const char *path, sim_ps (*time)(void));
void irqlog_line_rose(unsigned exception, sim_ps at, sim_ps period_start);
void irqlog_entered(unsigned exception, unsigned entry_cycles);
void irqlog_returned(bool chained);
/* The instruction under way writes COMPARE_C of the PWM whose conversions raise `exception`; its write is done at this count. A
 * handler of another line has not waited for it. */
void irqlog_pwm_written(unsigned exception, uint64_t done);
void irqlog_reset(void);
void irqlog_flush(void);

#endif

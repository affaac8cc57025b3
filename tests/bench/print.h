/* SPDX-License-Identifier: MIT */
/*
 * The table on MMUART_0, for people and for programs. Columns are separated by blanks, names contain none:
 *
 *     NAME  MIN MEDIAN MAX  [moves M]  [O2 MIN MEDIAN MAX  O3 MIN MEDIAN MAX]
 *
 * Lines that begin with '#' are remarks. The last line is "bench: N rows".
 */
#ifndef TESTS_BENCH_PRINT_H
#define TESTS_BENCH_PRINT_H

#include <stdint.h>

#include "drivers/mss/mmuart.h"
#include "tests/bench/timing.h"

extern struct mmuart print_uart; /* where it goes; its transmit buffer may be used for other text between two rows */

/* What stands beside the arithmetic rows. */
struct print_comparison {
    uint32_t moves;
    struct timing_figures o2, o3;
};

void print_start(uint32_t baud);
void print_text(const char *text);
void print_number(uint32_t value);
void print_note(const char *name, uint32_t value);
void print_heading(const char *text);

/* `comparison` may be NULL. */
void print_row(const char *name, const struct timing_figures *figures, const struct print_comparison *comparison);

/* Waits until everything is out. */
void print_flush(void);

void print_closing(void);

#endif

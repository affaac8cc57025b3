/* SPDX-License-Identifier: MIT */
/* The groups of rows, in the order of the table. Each prints its rows as it goes. */
#ifndef TESTS_BENCH_ROWS_H
#define TESTS_BENCH_ROWS_H

#include "tests/bench/timing.h"
#include "tests/bench/vectors.h"

/* One set of samples is enough: groups run one after the other. */
extern struct timing rows_timing;

/* Prints what has been timed since timing_begin(&rows_timing). */
void rows_print(const char *name);

/* Over typical vectors of so many words, and over all of corners. */
struct timing_figures rows_over_vectors(timer_function timer, const struct vector_range *typical,
                                        const struct vector_range *extreme, uint32_t words);

/* The library's functions, each beside its portable C. */
void rows_arithmetic(void);

/* The kernels once more, without moves between memory and registers. */
void rows_registers(void);

/* The functions of LibFoc.h. */
void rows_family(void);

/* The current loop. */
void rows_current_loop(void);

/* The scope. */
void rows_scope(void);

/* What runs once a millisecond. */
void rows_slow_loop(void);

/* What runs once in a while: faults and the console. */
void rows_seldom(void);

/* The tables of torque, for the axis's parameters. */
void rows_build_tables(void);

/* What the core itself takes to enter and leave an interrupt. */
void rows_interrupt(void);

/*
 * Times an interrupt as the core takes it, raised by software: everything from its request to the instruction after it,
 * less the same with the interrupt disabled. What remains is entry, handler and exit. The line must be low.
 */
uint32_t rows_time_interrupt(uint32_t irq);

#endif

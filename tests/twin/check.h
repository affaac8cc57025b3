/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What the programs of this folder say, one line a check, for test_twin_models.py to read:
 *
 *     ok NAME
 *     FAIL NAME: expected X got Y
 *
 * and at last "N passed, N failed". */
#ifndef TESTS_TWIN_CHECK_H
#define TESTS_TWIN_CHECK_H

#include <stdbool.h>
#include <stdint.h>

void check_true(const char *name, bool good);
void check_equal(const char *name, int64_t got, int64_t expected);
void check_hex(const char *name, uint32_t got, uint32_t expected);
/* |got - expected| <= tolerance, in the unit of the two; not a number fails. */
void check_near(const char *name, double got, double expected, double tolerance);
void check_between(const char *name, double got, double low, double high);

/* Prints the closing line; returns what main() returns. */
int check_end(void);

/* One generator for all programs, so that a failure repeats on any machine. Both ends are included. */
uint32_t any_u32(void);
int any_between(int low, int high);
double any_real(double low, double high);

#endif

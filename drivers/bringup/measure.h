/* SPDX-License-Identifier: MIT */
/* Cycles of instructions that are told to the letter: measure.S. No interrupt is enabled, DWT runs. Context: thread. */
#ifndef DRIVERS_BRINGUP_MEASURE_H
#define DRIVERS_BRINGUP_MEASURE_H

#include <stdbool.h>
#include <stdint.h>

#define MEASURE_ACCESSES 64u
#define MEASURE_LOOK     2u /* the second look at CYCCNT is in each result */

/* Loads one after the other, each from the address that the one before has found: give them a word that holds its own. */
uint32_t measure_chase(const void *self);
uint32_t measure_chase_from_esram(const void *self);
/* Stores of 0. */
uint32_t measure_stores(volatile void *word);
/* Instructions of a word each, from eSRAM. */
uint32_t measure_fetches(void);
/* Loads with an instruction of one cycle behind each. */
uint32_t measure_loads(const volatile void *word);
/* A store of 0, a load, and an instruction of one cycle. */
uint32_t measure_reads_behind_writes(volatile void *word);

uint32_t measure_strides(const void *start, uint32_t stride_bytes, uint32_t count);
uint32_t measure_clear(uint32_t *start, const uint32_t *end);

/* Looks at CYCCNT: before an SVC, at its handler's begin and end, at the begin of the handler chained to it, and back. */
enum measure_look { LOOK_BEFORE, LOOK_ENTERED, LOOK_LEAVING, LOOK_CHAINED, LOOK_BACK, LOOKS };
void measure_exceptions(uint32_t looks[LOOKS]);

/* False if the load ends in a bus fault. */
bool measure_probe(const volatile uint32_t *address, uint32_t *value);

#endif

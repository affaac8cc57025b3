/* SPDX-License-Identifier: MIT */
/*
 * The cache of the code at 0 (UG0331, cache controller chapter), locked: it answers for the first 8 KB of the eNVM at once, and
 * whatever else runs does not push them out. The rest of the eNVM is then read without a cache, 64 bits at a time. What must
 * take the same time in every case stands in front: m2s010.ld.
 */
#ifndef DRIVERS_MSS_CACHE_H
#define DRIVERS_MSS_CACHE_H

#include <stdbool.h>
#include <stdint.h>

#define CACHE_BYTES      8192u
#define CACHE_LINE_BYTES 32u

/*
 * Empties the cache, copies the first CACHE_BYTES of eNVM into it and locks it. `code`: where the core sees them; `array`: the
 * same by the array's own address, which no cache serves. Every word is compared; if one differs, the cache is off. It is on,
 * but not locked, if the design does not let the firmware lock it. In either case the result is false. Runs from eSRAM.
 * Context: thread, at start, interrupts off.
 */
bool cache_lock(const volatile uint32_t *code, const volatile uint32_t *array);

#endif

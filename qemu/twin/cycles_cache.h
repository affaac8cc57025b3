/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What a word of the eNVM waits, by the core's code bus: nothing, always, or as the device's cache has it. That one is of 64
 * sets, 4 ways and lines of 32 bytes, and the line that was used longest ago goes. It is off until CC_CR says otherwise. Locked
 * it answers for the first 8 KB at once, keeps what it has, and leaves the rest to eNVM, which reads 64 bits at a time. */
#ifndef TWIN_CYCLES_CACHE_H
#define TWIN_CYCLES_CACHE_H

#include "cycles.h"

#define CYCLES_CACHE_BYTES 8192u

void cycles_cache_init(const struct cycles_params *p);
/* Empty. */
void cycles_cache_reset(void);
/* Other code has run for so long that no line is left, but of a locked cache all. */
void cycles_cache_evict(void);
/* Of an access that takes place now. */
unsigned cycles_cache_waits(uint32_t address);

#endif

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The core's cycle counter: DWT_CTRL and DWT_CYCCNT. What it counts is decided elsewhere. */
#ifndef TWIN_DWT_H
#define TWIN_DWT_H

#include <stdint.h>

#define DWT_BASE  0xE0001000u
#define DWT_BYTES 0x1000u

struct dwt {
    uint64_t (*elapsed)(void); /* cycles since power-on, from the cycle source */
    uint32_t control;
    uint32_t count; /* value at `since` */
    uint64_t since; /* reading of the source when count was last set */
};

void dwt_init(struct dwt *d, uint64_t (*elapsed)(void));
void dwt_reset(struct dwt *d);
uint32_t dwt_read(void *dwt, uint32_t offset);
void dwt_write(void *dwt, uint32_t offset, uint32_t value);

#endif

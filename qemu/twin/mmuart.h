/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The registers of MMUART_0 beyond those of a 16550 (MM0...DFR...ADR): storage, which is what they are as long as
 * nothing but the baud rate depends on them. */
#ifndef TWIN_MMUART_H
#define TWIN_MMUART_H

#include <stdint.h>

#define MMUART_EXTENSION_BASE  0x40000020u
#define MMUART_EXTENSION_BYTES 0x40u

struct mmuart_extension {
    uint32_t word[MMUART_EXTENSION_BYTES / 4];
};

uint32_t mmuart_read(void *mmuart, uint32_t offset);
void mmuart_write(void *mmuart, uint32_t offset, uint32_t value);

#endif

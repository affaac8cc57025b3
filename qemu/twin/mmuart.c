/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "mmuart.h"

uint32_t mmuart_read(void *mmuart, uint32_t offset)
{
    const struct mmuart_extension *m = mmuart;
    return m->word[offset / 4];
}

void mmuart_write(void *mmuart, uint32_t offset, uint32_t value)
{
    struct mmuart_extension *m = mmuart;
    m->word[offset / 4] = value & 0xFF; /* eight bits wide on the APB */
}

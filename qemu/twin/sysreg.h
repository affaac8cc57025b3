/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The SYSREG words that a Libero design for docs/fabric.md sets and that stock QEMU leaves at other values, and the
 * cause of the last reset. */
#ifndef TWIN_SYSREG_H
#define TWIN_SYSREG_H

#include <stdint.h>

#define SYSREG_BASE 0x40038000u

enum reset_cause { RESET_POWER_ON = 1u << 0, RESET_SOFT = 1u << 3, RESET_WATCHDOG = 1u << 5 };

struct sysreg_word {
    uint32_t offset;
    uint32_t initial;  /* from the flash bits of the design, at every reset */
    uint32_t writable; /* mask */
    uint32_t value;
};

#define SYSREG_WORDS 8
extern struct sysreg_word sysreg_words[SYSREG_WORDS];

uint32_t sysreg_read(void *word, uint32_t offset);
void sysreg_write(void *word, uint32_t offset, uint32_t value);
void sysreg_reset(enum reset_cause cause);

#endif

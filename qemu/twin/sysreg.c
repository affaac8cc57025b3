/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "sysreg.h"

enum {
    EDAC_CR = 0x38,
    SOFT_RESET_CR = 0x48,
    WDOG_CR = 0x6C,
    FACC1_CR = 0x98,
    RESET_SOURCE_CR = 0xB0,
    PLL_STATUS = 0x150,
    WDOGLOAD = 0x16C,
    WDOGMVRP = 0x170,
};

#define ALL 0xFFFFFFFFu
/* Released by the design: eNVM_0, eSRAM_0/1, TIMER, MMUART_0, fabric, FIC_0, GPIO and its outputs. */
#define HELD_IN_RESET (0x07FFFFFFu & ~(1u << 0 | 3u << 2 | 1u << 6 | 1u << 7 | 1u << 16 | 1u << 18 | 0x1Fu << 20))

struct sysreg_word sysreg_words[SYSREG_WORDS] = {
    {RESET_SOURCE_CR, 0, ALL, 0}, /* first: sysreg_reset() relies on it */
    {EDAC_CR, 0x3, ALL, 0},       /* SECDED on both eSRAMs */
    {SOFT_RESET_CR, HELD_IN_RESET, ALL, 0},
    {WDOG_CR, 0x1, 0, 0},    /* enabled, reset mode */
    {FACC1_CR, 0, ALL, 0},   /* every divisor 1, clocked from the PLL */
    {PLL_STATUS, 0x3, 0, 0}, /* both locked */
    {WDOGLOAD, 0x1312D, 0, 0},
    {WDOGMVRP, ALL, 0, 0},
};

uint32_t sysreg_read(void *word, uint32_t offset)
{
    const struct sysreg_word *w = word;
    (void)offset;
    return w->value;
}

void sysreg_write(void *word, uint32_t offset, uint32_t value)
{
    struct sysreg_word *w = word;
    (void)offset;
    w->value = (w->value & ~w->writable) | (value & w->writable);
}

void sysreg_reset(enum reset_cause cause)
{
    uint32_t earlier_causes = sysreg_words[0].value; /* sticky until firmware clears them */
    for (int n = 0; n < SYSREG_WORDS; n++) {
        sysreg_words[n].value = sysreg_words[n].initial;
    }
    sysreg_words[0].value = cause == RESET_POWER_ON ? (uint32_t)cause : earlier_causes | (uint32_t)cause;
}

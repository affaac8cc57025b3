/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "sysreg.h"

#include <stddef.h>

enum {
    ENVM_CR = 0x0C,
    CC_CR = SYSREG_CC_CR,
    EDAC_CR = 0x38,
    SOFT_RESET_CR = SYSREG_SOFT_RESET_CR,
    WDOG_CR = SYSREG_WDOG_CR,
    EDAC_IRQ_ENABLE = 0x78,
    ESRAM_PIPELINE_CR = 0x80,
    FACC1_CR = 0x98,
    PLL_LOCK_EN_CR = 0xA0,
    RESET_SOURCE_CR = 0xB0,
    ESRAM0_EDAC_CNT = 0xF0,
    ESRAM1_EDAC_CNT = 0xF4,
    DEVICE_VERSION = 0x14C,
    PLL_STATUS = 0x150,
    WDOGLOAD = SYSREG_WDOGLOAD,
    WDOGMVRP = 0x170,
    EDAC_SR = 0x190,
};

#define ALL 0xFFFFFFFFu
/* Released by the design: eNVM_0, eSRAM_0/1, TIMER, MMUART_0, FIC_0, GPIO and its outputs; the fabric only at power-on. */
#define HELD_IN_RESET (0x07FFFFFFu & ~(1u << 0 | 3u << 2 | 1u << 6 | 1u << 7 | 1u << 18 | 0x1Fu << 20))
#define HOLDS_FABRIC  (1u << 16)
#define EDAC_FLAGS    0x3FCFu   /* b4 and b5 are reserved: the cache has no EDAC */
#define EVERY_CAUSE   0xFFu     /* RESET_SOURCE_CR after power-on: each bit's reset value is 1 */
#define ONE_BIT       (1u << 0) /* of eSRAM_0, in EDAC_SR and EDAC_IRQ_ENABLE */
#define TWO_BITS      (1u << 1)

struct sysreg_word sysreg_words[SYSREG_WORDS] = {
    {RESET_SOURCE_CR, 0, ALL, 0, 0}, /* first: sysreg_reset() relies on it */
    {EDAC_CR, 0x3, ALL, 0, 0},       /* SECDED on both eSRAMs */
    {SOFT_RESET_CR, HELD_IN_RESET, ALL, 0, 0},
    {WDOG_CR, 0x1, 0, 0, 0}, /* enabled, reset mode */
    {EDAC_IRQ_ENABLE, 0, EDAC_FLAGS, 0, 0},
    {FACC1_CR, 0, ALL, 0, 0}, /* every divisor 1, clocked from the PLL */
    {ESRAM0_EDAC_CNT, 0, 0, 0, 0},
    {ESRAM1_EDAC_CNT, 0, 0, 0, 0},
    {PLL_STATUS, 0x3, 0, 0, 0}, /* both locked */
    {WDOGLOAD, 0, 0, 0, 0},     /* sysreg_design() */
    {WDOGMVRP, ALL, 0, 0, 0},
    {EDAC_SR, 0, 0, EDAC_FLAGS, 0},
    {ENVM_CR, 0xE0, ALL, 0, 0}, /* NV_FREQRNG 7 */
    {CC_CR, 0, ALL, 0, 0},
    {ESRAM_PIPELINE_CR, 0x1, ALL, 0, 0},
    {PLL_LOCK_EN_CR, 0xA, ALL, 0, 0}, /* the lost locks */
    {DEVICE_VERSION, 0xF802, 0, 0, 0},
};

static struct sysreg_word *word_at(uint32_t offset)
{
    for (int n = 0; n < SYSREG_WORDS; n++) {
        if (sysreg_words[n].offset == offset) {
            return &sysreg_words[n];
        }
    }
    return NULL;
}

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
    w->value = (w->value & ~w->writable & ~(value & w->clears)) | (value & w->writable);
}

void sysreg_reset(enum reset_cause cause)
{
    uint32_t earlier_causes = sysreg_words[0].value; /* sticky until firmware clears them */
    for (int n = 0; n < SYSREG_WORDS; n++) {
        sysreg_words[n].value = sysreg_words[n].initial;
    }
    if (cause == RESET_POWER_ON) {
        word_at(SOFT_RESET_CR)->value &= ~HOLDS_FABRIC; /* the system controller's doing */
    }
    sysreg_words[0].value = cause == RESET_POWER_ON ? EVERY_CAUSE : earlier_causes | (uint32_t)cause;
}

bool sysreg_holds_fabric(void)
{
    return (word_at(SOFT_RESET_CR)->value & HOLDS_FABRIC) != 0;
}

bool sysreg_design(uint32_t offset, uint32_t word)
{
    struct sysreg_word *w = word_at(offset);
    if (w) {
        w->initial = word;
    }
    return w != NULL;
}

uint32_t sysreg_value(uint32_t offset)
{
    return word_at(offset)->value;
}

void sysreg_set_lock(enum sysreg_pll pll, bool locked)
{
    struct sysreg_word *w = word_at(PLL_STATUS);
    w->value = locked ? w->value | pll : w->value & ~(uint32_t)pll;
    w->initial = w->value;
}

bool sysreg_memory_error(bool fatal)
{
    const uint32_t flag = fatal ? TWO_BITS : ONE_BIT;
    word_at(EDAC_SR)->value |= flag;
    word_at(ESRAM0_EDAC_CNT)->value += fatal ? 1u << 16 : 1u;
    return (word_at(EDAC_IRQ_ENABLE)->value & flag) != 0;
}

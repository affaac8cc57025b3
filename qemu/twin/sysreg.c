/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "sysreg.h"

#include <stddef.h>

enum {
    ENVM_CR = 0x0C,
    CC_CR = SYSREG_CC_CR,
    EDAC_CR = 0x38,
    MASTER_WEIGHT0_CR = 0x3C,
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
    MSS_GPIO_DEF = SYSREG_GPIO_DEF,
    EDAC_SR = 0x190,
    FLUSH_CR = 0x1A8,
};

#define ALL 0xFFFFFFFFu
/* Released: what Libero releases always (eNVMs, eSRAMs, DMAs, TIMER, COMBLK), both MMUARTs, FIC_0, GPIO and its outputs; the
 * fabric only at power-on. */
#define HELD_IN_RESET (0x07FFFFFFu & ~(0xFu << 0 | 0xFu << 5 | 1u << 15 | 3u << 17 | 0x1Fu << 20))
#define HOLDS_FABRIC  (1u << 16)
#define EDAC_FLAGS    0x3FCFu /* b4 and b5 are reserved: the cache has no EDAC */
#define MDDR_ECC_IRQ  (1u << 14)
#define FLUSHES_CACHE (1u << 0)
#define EVERY_CAUSE   0xFFu     /* RESET_SOURCE_CR after power-on: each bit's reset value is 1 */
#define ONE_BIT       (1u << 0) /* of eSRAM_0, in EDAC_SR and EDAC_IRQ_ENABLE */
#define TWO_BITS      (1u << 1)

/* which registers traffic can put back: user guide, 21.5.1 */
struct sysreg_word sysreg_words[SYSREG_WORDS] = {
    /* first: sysreg_reset() relies on it; sysreg_fix() makes a device of it on which ones clear, and zeros do not */
    {.offset = RESET_SOURCE_CR, .writable = ALL, .clears = ALL},
    {.offset = EDAC_CR, .initial = 0x3, .writable = ALL}, /* SECDED on both eSRAMs */
    {.offset = SOFT_RESET_CR, .initial = HELD_IN_RESET, .writable = ALL, .at_traffic = ALL},
    /* enabled, reset mode; of the watchdog's registers nothing but power-on is a reset: user guide, 19.5 */
    {.offset = WDOG_CR, .initial = 0x1, .writable = 0x3, .at_traffic = 0x3, .kept = true},
    {.offset = EDAC_IRQ_ENABLE, .initial = MDDR_ECC_IRQ, .writable = EDAC_FLAGS | MDDR_ECC_IRQ, .at_traffic = ALL},
    {.offset = FACC1_CR, .initial = 0x0A000000, .writable = ALL}, /* every divisor 1, PLL fed by CLK_BASE and in use */
    {.offset = ESRAM0_EDAC_CNT},
    {.offset = ESRAM1_EDAC_CNT},
    {.offset = PLL_STATUS, .initial = 0x3}, /* both locked */
    {.offset = WDOGLOAD, .kept = true},     /* sysreg_design() */
    {.offset = WDOGMVRP, .initial = ALL, .kept = true},
    {.offset = EDAC_SR, .clears = EDAC_FLAGS},
    {.offset = ENVM_CR, .initial = 0x91, .writable = ALL}, /* NV_FREQRNG 4: 100 MHz; 256 KB of eNVM at 0 */
    {.offset = CC_CR, .writable = ALL},
    {.offset = MASTER_WEIGHT0_CR, .initial = 0x02108420, .writable = ALL}, /* the cache's 32, all others 1 */
    {.offset = ESRAM_PIPELINE_CR, .initial = 0x1, .writable = ALL},
    {.offset = PLL_LOCK_EN_CR, .initial = 0xA, .writable = ALL}, /* the lost locks */
    {.offset = MSS_GPIO_DEF, .initial = 0xE},                    /* pins 7 to 0 begin low */
    {.offset = DEVICE_VERSION, .initial = 0xF802},
    {.offset = FLUSH_CR}, /* pulses: reads as 0 */
};

static unsigned flushes;

static struct sysreg_word *word_at(uint32_t offset)
{
    static struct sysreg_word *known[FLUSH_CR / 4 + 1]; /* by word: some are asked for at every fetch */
    for (int n = 0; n < SYSREG_WORDS && !(offset <= FLUSH_CR && known[offset / 4]); n++) {
        if (sysreg_words[n].offset == offset) {
            known[offset / 4] = &sysreg_words[n];
        }
    }
    return offset <= FLUSH_CR ? known[offset / 4] : NULL;
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
    flushes += w->offset == FLUSH_CR && (value & FLUSHES_CACHE) != 0;
    w->value = (w->value & ~w->writable & ~(value & w->clears)) | (value & w->writable);
}

void sysreg_reset(enum reset_cause cause)
{
    uint32_t earlier_causes = sysreg_words[0].value; /* sticky until firmware clears them */
    for (int n = 0; n < SYSREG_WORDS; n++) {
        struct sysreg_word *w = &sysreg_words[n];
        if (cause == RESET_POWER_ON || !w->kept) {
            w->value = w->after_reset = w->initial;
        }
    }
    if (cause == RESET_POWER_ON) {
        word_at(SOFT_RESET_CR)->after_reset = word_at(SOFT_RESET_CR)->value &=
            ~HOLDS_FABRIC; /* the controller's doing */
    }
    sysreg_words[0].value = cause == RESET_POWER_ON ? EVERY_CAUSE : earlier_causes | (uint32_t)cause;
}

void sysreg_put_back(void)
{
    for (int n = 0; n < SYSREG_WORDS; n++) {
        struct sysreg_word *w = &sysreg_words[n];
        w->value = (w->value & ~w->at_traffic) | (w->after_reset & w->at_traffic);
    }
}

bool sysreg_holds(uint32_t block)
{
    return (word_at(SOFT_RESET_CR)->value & block) != 0;
}

bool sysreg_holds_fabric(void)
{
    return sysreg_holds(HOLDS_FABRIC);
}

bool sysreg_design(uint32_t offset, uint32_t word)
{
    struct sysreg_word *w = word_at(offset);
    if (w) {
        w->initial = word;
    }
    return w != NULL;
}

void sysreg_fix(uint32_t offset, uint32_t bits)
{
    word_at(offset)->writable &= ~bits;
}

unsigned sysreg_cache_flushes(void)
{
    return flushes;
}

uint32_t sysreg_value(uint32_t offset)
{
    return word_at(offset)->value;
}

void sysreg_leave_as_openocd(void)
{
    sysreg_write(word_at(WDOG_CR), WDOG_CR, 0);
    sysreg_write(word_at(CC_CR), CC_CR, 0);
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

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The SYSREG words that a Libero design for docs/fabric.md sets and that stock QEMU leaves at other values, and the
 * cause of the last reset. */
#ifndef TWIN_SYSREG_H
#define TWIN_SYSREG_H

#include <stdbool.h>
#include <stdint.h>

#define SYSREG_BASE 0x40038000u

enum reset_cause {
    RESET_POWER_ON = 1u << 0,
    RESET_SOFT = 1u << 3,
    RESET_LOCKUP = 1u << 4,
    RESET_WATCHDOG = 1u << 5,
    RESET_USER = 1u << 6 /* from outside, by MSS_RESET_N_F2M */
};

struct sysreg_word {
    uint32_t offset;
    uint32_t initial; /* from the flash bits of the design, at every reset or at power-on alone: kept */
    bool kept;
    uint32_t writable;   /* mask */
    uint32_t clears;     /* mask of bits that writing 1 clears */
    uint32_t at_traffic; /* mask of bits that traffic on FIC_0 can put back, if firmware has changed them */
    uint32_t value;
    uint32_t after_reset;
};

#define SYSREG_WORDS 20
extern struct sysreg_word sysreg_words[SYSREG_WORDS];

uint32_t sysreg_read(void *word, uint32_t offset);
void sysreg_write(void *word, uint32_t offset, uint32_t value);
/* Bit 16 of SOFT_RESET_CR keeps MSS_RESET_N_M2F low: after any reset but power-on, until firmware clears it. */
bool sysreg_holds_fabric(void);
/* Blocks that are held in reset. */
enum { SYSREG_MMUART1 = 1u << 8, SYSREG_CAN = 1u << 13 };
bool sysreg_holds(uint32_t block);
void sysreg_reset(enum reset_cause cause);
/* What M2S005 and M2S010 do at some access to FIC_0: what firmware has changed is as the reset left it. */
void sysreg_put_back(void);

/* The design's bits of a register that the table has, false if it does not: in effect from the next reset on. */
bool sysreg_design(uint32_t offset, uint32_t word);
/* Bits of a register that the table has which the design keeps the firmware from changing. */
void sysreg_fix(uint32_t offset, uint32_t bits);
uint32_t sysreg_value(uint32_t offset);
/* What OpenOCD's target/microsemi-cortex-m3.cfg writes behind a reset: WDOG_CR and CC_CR to 0 (ilg-archived/openocd). */
void sysreg_leave_as_openocd(void);
/* How often FLUSH_CR has emptied the cache. */
unsigned sysreg_cache_flushes(void);

/* Locks do not care about a reset. */
enum sysreg_pll { SYSREG_FABRIC_PLL = 1u << 0, SYSREG_MSS_PLL = 1u << 1 };
void sysreg_set_lock(enum sysreg_pll pll, bool locked);

/* A word of eSRAM_0 is read with one bit wrong, or with two. Returns whether that raises the interrupt. */
bool sysreg_memory_error(bool fatal);

enum { SYSREG_MSS_PLL_IRQ = 23, SYSREG_ECC_IRQ = 29, SYSREG_FABRIC_PLL_IRQ = 32 };
enum {
    SYSREG_CC_CR = 0x18,
    SYSREG_SOFT_RESET_CR = 0x48,
    SYSREG_WDOG_CR = 0x6C,
    SYSREG_WDOGLOAD = 0x16C,
    SYSREG_GPIO_DEF = 0x18C
};

#endif

/* SPDX-License-Identifier: MIT */
/*
 * System registers (UG0331, system register block chapter): resets, reset cause, clock ratios. Names and offsets as in
 * the guide.
 *
 * On the M2S005 and M2S010, traffic on FIC_0 can make bits that firmware changed here fall back to their flash values.
 * So the Libero design sets everything (docs/fabric.md), and drivers change only what they must: SOFT_RESET_CR at start,
 * EDAC_IRQ_ENABLE, and WDOG_CR where somebody has cleared it. The slow loop looks after all three.
 */
#ifndef DRIVERS_MSS_SYSREG_H
#define DRIVERS_MSS_SYSREG_H

#include "drivers/reg.h"

struct sysreg_regs {
    volatile uint32_t ESRAM_CR;
    volatile uint32_t ESRAM_MAX_LAT;
    volatile uint32_t DDR_CR;
    volatile uint32_t ENVM_CR;
    volatile uint32_t ENVM_REMAP_BASE_CR;
    volatile uint32_t ENVM_REMAP_FAB_CR;
    volatile uint32_t CC_CR;
    volatile uint32_t CC_REGION_CR;
    uint32_t reserved_020[6]; /* cache lock, DDR bridge */
    volatile uint32_t EDAC_CR;
    volatile uint32_t MASTER_WEIGHT0_CR;
    uint32_t reserved_040[2]; /* further masters' weights, software interrupt */
    volatile uint32_t SOFT_RESET_CR;
    volatile uint32_t M3_CR;
    volatile uint32_t FAB_IF_CR;
    uint32_t reserved_054[6]; /* loop back, pin multiplexers, MDDR */
    volatile uint32_t WDOG_CR;
    uint32_t reserved_070[2];
    volatile uint32_t EDAC_IRQ_ENABLE;
    uint32_t reserved_07c; /* USB */
    volatile uint32_t ESRAM_PIPELINE_CR;
    uint32_t reserved_084[5];
    volatile uint32_t MSSDDR_FACC1_CR;
    volatile uint32_t MSSDDR_FACC2_CR;
    volatile uint32_t PLL_LOCK_EN_CR;
    uint32_t reserved_0a4[3];
    volatile uint32_t RESET_SOURCE_CR;
    uint32_t reserved_0b4[15]; /* cache and DDR bridge counters */
    const volatile uint32_t ESRAM0_EDAC_CNT;
    const volatile uint32_t ESRAM1_EDAC_CNT;
    uint32_t reserved_0f8[21];
    const volatile uint32_t DEVICE_VERSION;
    const volatile uint32_t MSSDDR_PLL_STATUS;
    uint32_t reserved_154[6];
    const volatile uint32_t WDOGLOAD;
    const volatile uint32_t WDOGMVRP;
    uint32_t reserved_174[6];
    const volatile uint32_t MSS_GPIO_DEF;
    volatile uint32_t EDAC_SR; /* write 1 clears */
    uint32_t reserved_194[2];
    volatile uint32_t WDOGTIMEOUTEVENT;
    uint32_t reserved_1a0[2]; /* counters to 0 */
    volatile uint32_t FLUSH_CR;
};

REG_AT_OFFSET(struct sysreg_regs, ESRAM_CR, 0x000);
REG_AT_OFFSET(struct sysreg_regs, ESRAM_MAX_LAT, 0x004);
REG_AT_OFFSET(struct sysreg_regs, DDR_CR, 0x008);
REG_AT_OFFSET(struct sysreg_regs, ENVM_CR, 0x00C);
REG_AT_OFFSET(struct sysreg_regs, ENVM_REMAP_BASE_CR, 0x010);
REG_AT_OFFSET(struct sysreg_regs, ENVM_REMAP_FAB_CR, 0x014);
REG_AT_OFFSET(struct sysreg_regs, CC_CR, 0x018);
REG_AT_OFFSET(struct sysreg_regs, CC_REGION_CR, 0x01C);
REG_AT_OFFSET(struct sysreg_regs, EDAC_CR, 0x038);
REG_AT_OFFSET(struct sysreg_regs, MASTER_WEIGHT0_CR, 0x03C);
REG_AT_OFFSET(struct sysreg_regs, SOFT_RESET_CR, 0x048);
REG_AT_OFFSET(struct sysreg_regs, M3_CR, 0x04C);
REG_AT_OFFSET(struct sysreg_regs, FAB_IF_CR, 0x050);
REG_AT_OFFSET(struct sysreg_regs, WDOG_CR, 0x06C);
REG_AT_OFFSET(struct sysreg_regs, EDAC_IRQ_ENABLE, 0x078);
REG_AT_OFFSET(struct sysreg_regs, ESRAM_PIPELINE_CR, 0x080);
REG_AT_OFFSET(struct sysreg_regs, MSSDDR_FACC1_CR, 0x098);
REG_AT_OFFSET(struct sysreg_regs, MSSDDR_FACC2_CR, 0x09C);
REG_AT_OFFSET(struct sysreg_regs, PLL_LOCK_EN_CR, 0x0A0);
REG_AT_OFFSET(struct sysreg_regs, RESET_SOURCE_CR, 0x0B0);
REG_AT_OFFSET(struct sysreg_regs, ESRAM0_EDAC_CNT, 0xF0);
REG_AT_OFFSET(struct sysreg_regs, ESRAM1_EDAC_CNT, 0xF4);
REG_AT_OFFSET(struct sysreg_regs, DEVICE_VERSION, 0x14C);
REG_AT_OFFSET(struct sysreg_regs, MSSDDR_PLL_STATUS, 0x150);
REG_AT_OFFSET(struct sysreg_regs, WDOGLOAD, 0x16C);
REG_AT_OFFSET(struct sysreg_regs, WDOGMVRP, 0x170);
REG_AT_OFFSET(struct sysreg_regs, MSS_GPIO_DEF, 0x18C);
REG_AT_OFFSET(struct sysreg_regs, EDAC_SR, 0x190);
REG_AT_OFFSET(struct sysreg_regs, WDOGTIMEOUTEVENT, 0x19C);
REG_AT_OFFSET(struct sysreg_regs, FLUSH_CR, 0x1A8);

#define SYSREG REG_BLOCK(struct sysreg_regs, 0x40038000u)

/* SOFT_RESET_CR: 1 = held in reset */
#define SYSREG_RESET_TIMER   (1u << 6)
#define SYSREG_RESET_MMUART0 (1u << 7)
#define SYSREG_RESET_MMUART1 (1u << 8)
#define SYSREG_RESET_CAN     (1u << 13)
#define SYSREG_RESET_FABRIC  (1u << 16) /* MSS_RESET_N_M2F: held after any reset but power-on */
#define SYSREG_RESET_HPDMA   (1u << 17)
#define SYSREG_RESET_FIC0    (1u << 18)
#define SYSREG_RESET_GPIO    (1u << 20)
#define SYSREG_RESET_GPOUT   (0xFu << 21)

/* RESET_SOURCE_CR; power-on sets every bit, and whoever starts first clears them, so that the next reset's can be told */
#define SYSREG_CAUSE_POWER_ON      (1u << 0)
#define SYSREG_CAUSE_CONTROLLER    (1u << 1)
#define SYSREG_CAUSE_CONTROLLER_M3 (1u << 2)
#define SYSREG_CAUSE_SOFT          (1u << 3) /* SYSRESETREQ, scb_system_reset() */
#define SYSREG_CAUSE_LOCKUP        (1u << 4)
#define SYSREG_CAUSE_WATCHDOG      (1u << 5)
#define SYSREG_CAUSE_USER          (1u << 6)
#define SYSREG_CAUSE_USER_M3       (1u << 7)
#define SYSREG_CAUSE_ALL           0xFFu

#define SYSREG_CC_CR_ENABLE     (1u << 0)
#define SYSREG_CC_CR_LOCK       (1u << 2)
#define SYSREG_FLUSH_CACHE      (1u << 0) /* of FLUSH_CR: empties it */
#define SYSREG_CC_REGION_CODE_0 (1u << 0) /* the lowest of four slots of 128 MB */

#define SYSREG_WEIGHT_IC 0x1Fu /* of MASTER_WEIGHT0_CR: accesses in a row of the cache's; 0 is 32 */

#define SYSREG_WDOG_ENABLE (1u << 0) /* of WDOG_CR; with b1, WDOGMODE, at 0 a time-out resets */

#define SYSREG_FACC1_GLMUX_SEL           (1u << 12) /* 1: running from the standby clock, not the PLL */
#define SYSREG_FACC1_CONTROLLER_PLL_INIT (1u << 26) /* 1: clock bring-up not finished */
#define SYSREG_PLL_STATUS_FABRIC_LOCK    (1u << 0)
#define SYSREG_PLL_STATUS_MPLL_LOCK      (1u << 1)
#define SYSREG_PLL_LOCK_EN_LOST          0x0Au /* of PLL_LOCK_EN_CR: a lost lock of either PLL interrupts */

/* EDAC_SR and EDAC_IRQ_ENABLE: a pair of bits each for eSRAM_0 and eSRAM_1; the even ones were corrected */
#define SYSREG_EDAC_FATAL 0x0Au /* two bits of a word were wrong */
#define SYSREG_EDAC_ALL   0x0Fu
#define SYSREG_EDAC_CNT_1 0xFFFFu /* of ESRAMx_EDAC_CNT: words corrected; those that could not be are above */

/*
 * Switches the instruction cache on for the code at 0 (off after reset): without it every fetch waits for eNVM. Context:
 * thread, at start.
 */
void sysreg_enable_cache(void);

/* Which blocks of `mask` are held in reset. One read. Context: any. */
static inline uint32_t sysreg_held(uint32_t mask)
{
    return SYSREG->SOFT_RESET_CR & mask;
}

/* Releases the blocks of `mask` (SYSREG_RESET_*) from reset; writes only if one of them is held. Context: thread. */
void sysreg_release_reset(uint32_t mask);

/*
 * Why the device started: SYSREG_CAUSE_* bits, since the last call. Clears them, whether zeros or ones do that: the guide has
 * plain bits, some of the vendor's programs write ones. Call it once, in main(). Start-up has read them before, to decide
 * whether .noinit is worth keeping. Context: thread.
 */
uint32_t sysreg_reset_cause(void);

/* Divisors from the MSS PLL's output to the clocks; 0 for a code the guide does not define. */
struct sysreg_clocks {
    uint32_t m3, apb0, apb1, fic0;
    bool from_pll; /* PLL locked, selected, and bring-up finished */
};

/* Context: any. */
struct sysreg_clocks sysreg_clock_ratios(void);

/* True if the MSS PLL and the fabric PLL are locked. One read. Context: any. */
static inline bool sysreg_plls_locked(void)
{
    const uint32_t both = SYSREG_PLL_STATUS_FABRIC_LOCK | SYSREG_PLL_STATUS_MPLL_LOCK;
    return (SYSREG->MSSDDR_PLL_STATUS & both) == both;
}

/* Memory errors found since sysreg_edac_watch(): SYSREG_EDAC_* bits. Context: any. */
static inline uint32_t sysreg_edac_flags(void)
{
    return SYSREG->EDAC_SR;
}

/* Lets uncorrectable errors raise MSS_IRQ_ECC_ERROR. Context: any. */
static inline void sysreg_edac_interrupts(void)
{
    SYSREG->EDAC_IRQ_ENABLE = SYSREG_EDAC_FATAL;
}

/* Clears earlier findings, and the same. Context: thread. */
void sysreg_edac_watch(void);

/* eSRAM words read with one wrong bit, and corrected, since the last reset; each block counts to 65535. */
uint32_t sysreg_edac_corrected(void);

/* True if the clocks match board.h, as far as the device knows: ratios and source, not rates. Context: any. */
bool sysreg_clocks_match_board(void);

#endif

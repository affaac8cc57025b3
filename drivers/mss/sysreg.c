/* SPDX-License-Identifier: MIT */
#include "drivers/mss/sysreg.h"

#include "drivers/board.h"

/* Fields of MSSDDR_FACC1_CR, three bits each. */
enum { FACC1_APB0 = 2, FACC1_APB1 = 5, FACC1_M3 = 9, FACC1_FIC0 = 13 };

void sysreg_enable_cache(void)
{
    SYSREG->CC_REGION_CR |= SYSREG_CC_REGION_CODE_0;
    SYSREG->CC_CR |= SYSREG_CC_CR_ENABLE;
}

void sysreg_release_reset(uint32_t mask)
{
    if (sysreg_held(mask) != 0u) {
        SYSREG->SOFT_RESET_CR &= ~mask;
    }
}

uint32_t sysreg_reset_cause(void)
{
    const uint32_t cause = SYSREG->RESET_SOURCE_CR & SYSREG_CAUSE_ALL;
    SYSREG->RESET_SOURCE_CR = 0u;
    SYSREG->RESET_SOURCE_CR = SYSREG->RESET_SOURCE_CR & SYSREG_CAUSE_ALL; /* what zeros have left */
    return cause;
}

void sysreg_edac_watch(void)
{
    SYSREG->EDAC_SR = SYSREG_EDAC_ALL;
    sysreg_edac_interrupts();
}

uint32_t sysreg_edac_corrected(void)
{
    return (SYSREG->ESRAM0_EDAC_CNT & SYSREG_EDAC_CNT_1) + (SYSREG->ESRAM1_EDAC_CNT & SYSREG_EDAC_CNT_1);
}

/* Codes 0, 1, 2, 4, 5, 6 are 1, 2, 4, 8, 16, 32; there is no 3. */
static uint32_t divisor(uint32_t facc1, uint32_t shift)
{
    static const uint8_t divisors[8] = {1, 2, 4, 0, 8, 16, 32, 0};
    return divisors[(facc1 >> shift) & 7u];
}

struct sysreg_clocks sysreg_clock_ratios(void)
{
    const uint32_t facc1 = SYSREG->MSSDDR_FACC1_CR;
    const uint32_t not_ready = SYSREG_FACC1_GLMUX_SEL | SYSREG_FACC1_CONTROLLER_PLL_INIT;
    return (struct sysreg_clocks){
        .m3 = divisor(facc1, FACC1_M3),
        .apb0 = divisor(facc1, FACC1_APB0),
        .apb1 = divisor(facc1, FACC1_APB1),
        .fic0 = divisor(facc1, FACC1_FIC0),
        .from_pll = (facc1 & not_ready) == 0u && (SYSREG->MSSDDR_PLL_STATUS & SYSREG_PLL_STATUS_MPLL_LOCK) != 0u,
    };
}

bool sysreg_clocks_match_board(void)
{
    const struct sysreg_clocks clocks = sysreg_clock_ratios();
    if (clocks.m3 == 0u || !clocks.from_pll) {
        return false;
    }
    /* Rates relative to each other: the PLL's own output is not in board.h. Exact, all rates divide each other. */
    const uint32_t pll_hz = BOARD_M3_HZ * clocks.m3;
    return BOARD_APB0_HZ * clocks.apb0 == pll_hz && BOARD_APB1_HZ * clocks.apb1 == pll_hz &&
           BOARD_FIC0_HZ * clocks.fic0 == pll_hz;
}

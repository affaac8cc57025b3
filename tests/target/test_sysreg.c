/* SPDX-License-Identifier: MIT */
/* SYSREG against its registers: reset cause, clocks, cache, resets of the blocks and of the fabric. */
#include "drivers/cortex/scb.h"
#include "drivers/fabric/fabric.h"
#include "drivers/mss/gpio.h"
#include "drivers/mss/sysreg.h"
#include "tests/target/harness.h"

static void test_sysreg(void)
{
    harness_equal("sysreg: power-on sets every cause", harness_reset_cause(), SYSREG_CAUSE_ALL);
    harness_equal("sysreg: the cause is cleared by reading it", sysreg_reset_cause(), 0u);

    const struct sysreg_clocks clocks = sysreg_clock_ratios();
    harness_equal("sysreg: M3 ratio", clocks.m3, 1u);
    harness_equal("sysreg: APB0 ratio", clocks.apb0, 1u);
    harness_equal("sysreg: APB1 ratio", clocks.apb1, 1u);
    harness_equal("sysreg: FIC_0 ratio", clocks.fic0, 1u);
    harness_true("sysreg: clocks from the PLL", clocks.from_pll);
    harness_true("sysreg: clocks are the board's", sysreg_clocks_match_board());
    harness_true("sysreg: both PLLs are locked", sysreg_plls_locked());

    const uint32_t facc1 = SYSREG->MSSDDR_FACC1_CR;
    SYSREG->MSSDDR_FACC1_CR = facc1 | SYSREG_FACC1_GLMUX_SEL;
    harness_true("sysreg: the standby clock is not the board's", !sysreg_clocks_match_board());
    SYSREG->MSSDDR_FACC1_CR = facc1 | (1u << 2);
    harness_equal("sysreg: APB0 ratio of code 1", sysreg_clock_ratios().apb0, 2u);
    harness_true("sysreg: APB0 at half rate is not the board's", !sysreg_clocks_match_board());
    SYSREG->MSSDDR_FACC1_CR = facc1 | (4u << 13);
    harness_equal("sysreg: FIC_0 ratio of code 4", sysreg_clock_ratios().fic0, 8u);
    SYSREG->MSSDDR_FACC1_CR = facc1 | (3u << 9);
    harness_equal("sysreg: code 3 is no ratio", sysreg_clock_ratios().m3, 0u);
    harness_true("sysreg: and not the board's", !sysreg_clocks_match_board());
    SYSREG->MSSDDR_FACC1_CR = facc1;

    const uint32_t resets = SYSREG->SOFT_RESET_CR;
    const uint32_t held = SYSREG_RESET_TIMER | SYSREG_RESET_GPIO | SYSREG_RESET_GPOUT;
    SYSREG->SOFT_RESET_CR = resets | held;
    sysreg_enable_cache();
    harness_equal("sysreg: cache on", SYSREG->CC_CR & SYSREG_CC_CR_ENABLE, SYSREG_CC_CR_ENABLE);
    harness_equal("sysreg: for the code at 0", SYSREG->CC_REGION_CR & 0xFu, SYSREG_CC_REGION_CODE_0);
    gpio_init();
    harness_equal("sysreg: gpio_init releases its own resets only", SYSREG->SOFT_RESET_CR & held, SYSREG_RESET_TIMER);
    sysreg_release_reset(SYSREG_RESET_TIMER);
    harness_equal("sysreg: all released", SYSREG->SOFT_RESET_CR & held, 0u);
    SYSREG->SOFT_RESET_CR = resets;

    sysreg_edac_watch();
    harness_equal("sysreg: two wrong bits in either eSRAM interrupt", SYSREG->EDAC_IRQ_ENABLE, SYSREG_EDAC_FATAL);
}

enum stage { POWER_ON, AFTER_SOFT_RESET };

#define PERIOD_AFTER_RESET 2500u

static void test_fabric_after_power_on(void)
{
    harness_equal("fabric: released at power-on", SYSREG->SOFT_RESET_CR & SYSREG_RESET_FABRIC, 0u);
    harness_true("fabric: there", gate_id_ok(&FABRIC0->gate));
    FABRIC0->pwm.PERIOD = 1234u;
    harness_equal("fabric: a register is set", FABRIC0->pwm.PERIOD, 1234u);
    SYSREG->SOFT_RESET_CR |= SYSREG_RESET_FABRIC;
    harness_equal("fabric: held, reads 0", FABRIC0->gate.ID | FABRIC0->pwm.PERIOD, 0u);
    FABRIC0->pwm.PERIOD = 1234u;
    sysreg_release_reset(SYSREG_RESET_FABRIC);
    harness_true("fabric: there again", gate_id_ok(&FABRIC0->gate));
    harness_equal("fabric: as a reset leaves it", FABRIC0->pwm.PERIOD, PERIOD_AFTER_RESET);
    FABRIC0->pwm.PERIOD = 1234u;
}

static void test_fabric_after_soft_reset(void)
{
    harness_equal("fabric: a warm reset says so", harness_reset_cause(), SYSREG_CAUSE_SOFT);
    harness_equal("fabric: held after it", SYSREG->SOFT_RESET_CR & SYSREG_RESET_FABRIC, SYSREG_RESET_FABRIC);
    harness_equal("fabric: reads 0 until released", FABRIC0->gate.ID | FABRIC0->pwm.PERIOD, 0u);
    sysreg_release_reset(SYSREG_RESET_FABRIC);
    harness_true("fabric: there once released", gate_id_ok(&FABRIC0->gate));
    harness_equal("fabric: with the registers of a reset", FABRIC0->pwm.PERIOD, PERIOD_AFTER_RESET);
}

int main(void)
{
    if (harness_begin() == POWER_ON) {
        test_sysreg();
        test_fabric_after_power_on();
        harness_next_stage(AFTER_SOFT_RESET);
        scb_system_reset();
    }
    test_fabric_after_soft_reset();
    harness_end();
}

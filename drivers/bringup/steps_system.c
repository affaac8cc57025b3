/* SPDX-License-Identifier: MIT */
/* What the design and the System Controller have set: B01 to B04, and B16. */
#include "drivers/bringup/bringup.h"
#include "drivers/cortex/mpu.h"
#include "drivers/cortex/scb.h"

#define DEVICE_BITS 0xFFFFu

bool powered_on(const struct bringup *b)
{
    return (b->found.resets & SYSREG_RESET_FABRIC) == 0u;
}

void step_core(struct bringup *b)
{
    report(b, FACT_DEVICE, SYSREG->DEVICE_VERSION & DEVICE_BITS);
    report(b, FACT_CPUID, SCB->CPUID);
    report(b, FACT_MPU_TYPE, MPU->TYPE);
    report(b, FACT_DWT_CTRL, b->found.dwt_ctrl);
}

void step_causes(struct bringup *b)
{
    const bool cold = powered_on(b);
    report(b, cold ? FACT_CAUSES : FACT_CAUSES_WARM, b->found.causes);
    SYSREG->RESET_SOURCE_CR = 0u;
    report(b, FACT_CAUSES_ZEROS, SYSREG->RESET_SOURCE_CR);
    (void)sysreg_reset_cause();
    report(b, FACT_CAUSES_CLEARED, SYSREG->RESET_SOURCE_CR);
    report(b, cold ? FACT_RESETS : FACT_RESETS_WARM, b->found.resets & ~BY_THE_BOARD);
}

void step_clocks(struct bringup *b)
{
    const struct sysreg_clocks ratios = sysreg_clock_ratios();
    report(b, FACT_FACC1, SYSREG->MSSDDR_FACC1_CR);
    report(b, FACT_FACC2, SYSREG->MSSDDR_FACC2_CR);
    report(b, FACT_PLL_STATUS, SYSREG->MSSDDR_PLL_STATUS);
    report(b, FACT_PLL_LOCK_EN, SYSREG->PLL_LOCK_EN_CR & SYSREG_PLL_LOCK_EN_LOST);
    report(b, FACT_RATIO_M3, ratios.m3);
    report(b, FACT_RATIO_APB0, ratios.apb0);
    report(b, FACT_RATIO_APB1, ratios.apb1);
    report(b, FACT_RATIO_FIC0, ratios.fic0);
    report(b, FACT_FROM_PLL, ratios.from_pll ? 1u : 0u);
}

void step_memory(struct bringup *b)
{
    report(b, FACT_EDAC_CR, b->found.edac_cr);
    report(b, FACT_EDAC_IRQ, b->found.edac_irq);
    report(b, FACT_EDAC_SR, b->found.edac_sr);
    SYSREG->EDAC_SR = SYSREG_EDAC_ALL;
    report(b, FACT_EDAC_SR_CLEARED, SYSREG->EDAC_SR);
    report(b, FACT_PIPELINE, SYSREG->ESRAM_PIPELINE_CR);
    report(b, FACT_WEIGHTS, SYSREG->MASTER_WEIGHT0_CR);
}

void step_pins(struct bringup *b)
{
    report(b, FACT_PIN_CONFIG, b->found.pin_config);
    report(b, FACT_PIN_OUT, b->found.pin_out);
}

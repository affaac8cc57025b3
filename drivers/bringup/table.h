/* SPDX-License-Identifier: MIT */
/*
 * What the image looks at, and what docs/silicon.md says of it: a line a fact, from the least to the largest value that is as
 * documented. Values after a reset come from the page itself (documented.h is made of it); that the others are what the page
 * has for their step is what tests/bringup looks at.
 */
#ifndef DRIVERS_BRINGUP_TABLE_H
#define DRIVERS_BRINGUP_TABLE_H

#include "documented.h"
#include "drivers/fabric/gate.h"
#include "drivers/mss/envm.h"
#include "drivers/mss/mmuart.h"
#include "drivers/mss/sysreg.h"

#define ANY        0u, 0xFFFFFFFFu
#define ONE(value) (value), (value)

/* Of SOFT_RESET_CR, what a board's design uses or not; whether Libero releases a DMA that is off goes by its version. */
#define BY_THE_BOARD (SYSREG_RESET_MMUART1 | SYSREG_RESET_CAN | SYSREG_RESET_HPDMA)

/* X(name, step, format, least, largest, text) */
#define BRINGUP_FACTS(X) \
    X(DEVICE, "B01", HEX, 0xF802u, 0xF804u, "DEVICE_VERSION, lower half") \
    X(CPUID, "B01", HEX, ONE(0x412FC231u), "CPUID") \
    X(MPU_TYPE, "B01", HEX, ONE(0x800u), "MPU_TYPE") \
    X(DWT_CTRL, "B01", HEX, ONE(DOCUMENTED_RESET_DWT_CTRL), "DWT_CTRL") \
    X(CAUSES, "B02", HEX, ONE(DOCUMENTED_POWER_ON_SYSREG_RESET_SOURCE_CR), "RESET_SOURCE_CR as found") \
    X(CAUSES_WARM, "B02", HEX, 1u, SYSREG_CAUSE_ALL, "RESET_SOURCE_CR as found, no power-on") \
    X(CAUSES_ZEROS, "B02", HEX, 0u, SYSREG_CAUSE_ALL, "RESET_SOURCE_CR after writing 0") \
    X(CAUSES_CLEARED, "B02", HEX, ONE(0u), "and after writing what was left") \
    X(RESETS, "B02", HEX, ONE(DOCUMENTED_POWER_ON_SYSREG_SOFT_RESET_CR & ~BY_THE_BOARD), "SOFT_RESET_CR as found") \
    X(RESETS_WARM, "B02", HEX, ONE(DOCUMENTED_WARM_SYSREG_SOFT_RESET_CR & ~BY_THE_BOARD), \
      "SOFT_RESET_CR as found, no power-on") \
    X(FACC1, "B03", HEX, ONE(DOCUMENTED_RESET_SYSREG_MSSDDR_FACC1_CR), "MSSDDR_FACC1_CR") \
    X(FACC2, "B03", HEX, ANY, "MSSDDR_FACC2_CR") \
    X(PLL_STATUS, "B03", HEX, ONE(DOCUMENTED_RESET_SYSREG_MSSDDR_PLL_STATUS), "MSSDDR_PLL_STATUS") \
    X(PLL_LOCK_EN, "B03", HEX, ONE(SYSREG_PLL_LOCK_EN_LOST), "PLL_LOCK_EN_CR, of lost locks") \
    X(RATIO_M3, "B03", DECIMAL, ONE(1u), "ratio of M3_CLK") \
    X(RATIO_APB0, "B03", DECIMAL, ONE(1u), "ratio of APB0") \
    X(RATIO_APB1, "B03", DECIMAL, ONE(1u), "ratio of APB1") \
    X(RATIO_FIC0, "B03", DECIMAL, ONE(1u), "ratio of FIC_0") \
    X(FROM_PLL, "B03", DECIMAL, ONE(1u), "clocks come from the PLL") \
    X(EDAC_CR, "B04", HEX, ONE(DOCUMENTED_RESET_SYSREG_EDAC_CR), "EDAC_CR") \
    X(EDAC_IRQ, "B04", HEX, ONE(DOCUMENTED_RESET_SYSREG_EDAC_IRQ_ENABLE), "EDAC_IRQ_ENABLE") \
    X(EDAC_SR, "B04", HEX, ONE(DOCUMENTED_RESET_SYSREG_EDAC_SR), "EDAC_SR as found") \
    X(EDAC_SR_CLEARED, "B04", HEX, ONE(0u), "EDAC_SR after writing ones") \
    X(PIPELINE, "B04", HEX, ONE(DOCUMENTED_RESET_SYSREG_ESRAM_PIPELINE_CR), "ESRAM_PIPELINE_CR") \
    X(WEIGHTS, "B04", HEX, ONE(DOCUMENTED_RESET_SYSREG_MASTER_WEIGHT0_CR), "MASTER_WEIGHT0_CR") \
    X(WDOG_CR, "B05", HEX, ONE(DOCUMENTED_RESET_SYSREG_WDOG_CR), "WDOG_CR") \
    X(WDOG_CR_WARM, "B05", HEX, 0u, DOCUMENTED_RESET_SYSREG_WDOG_CR, "WDOG_CR as found, no power-on") \
    X(WDOGLOAD, "B05", HEX, ONE(DOCUMENTED_RESET_SYSREG_WDOGLOAD), "WDOGLOAD") \
    X(WDOGMVRP, "B05", HEX, ONE(DOCUMENTED_RESET_SYSREG_WDOGMVRP), "WDOGMVRP") \
    X(WDOGSTATUS, "B05", HEX, ONE(DOCUMENTED_RESET_WATCHDOG_WDOGSTATUS), "WDOGSTATUS") \
    X(REFRESH, "B05", DECIMAL, 0u, 70u, "ticks until a refresh shows") \
    X(WATCHDOG_RATE, "B05", DECIMAL, 475000u, 525000u, "watchdog ticks in 10^6 cycles") \
    X(ESRAM_LOAD, "B06", DECIMAL, 2u, 4u, "cycles of a load from eSRAM") \
    X(ESRAM_STORE, "B06", DECIMAL, ONE(1u), "cycles of a store to eSRAM") \
    X(ESRAM_FETCH, "B06", DECIMAL, 2u, 4u, "cycles of a fetch from eSRAM") \
    X(CLEAR, "B06", DECIMAL, 24500u, 25500u, "cycles to clear 64 KB") \
    X(HIT, "B07", DECIMAL, ONE(0u), "waits of a cache hit") \
    X(MISS, "B07", DECIMAL, 18u, 40u, "waits of a cache miss") \
    X(UNCACHED, "B07", DECIMAL, 4u, 9u, "waits of a load with the cache off") \
    X(LOCKED, "B07", DECIMAL, ONE(1u), "the cache locks, every word right") \
    X(LOCKED_LOAD, "B07", DECIMAL, ONE(0u), "waits of a load, locked") \
    X(BEYOND_LOAD, "B07", DECIMAL, 4u, 9u, "waits of a load beyond what is locked") \
    X(ENVM_CR, "B07", HEX, ONE(DOCUMENTED_RESET_SYSREG_ENVM_CR), "ENVM_CR") \
    X(FIC_READ, "B08", DECIMAL, 2u, 8u, "waits of a read by FIC_0") \
    X(FIC_WRITE, "B08", DECIMAL, 2u, 8u, "waits of a write, seen by the next") \
    X(FIC_READ_BEHIND, "B08", DECIMAL, 4u, 17u, "waits of a read behind a write") \
    X(ENTRY, "B09", DECIMAL, 13u, 24u, "cycles of exception entry") \
    X(EXIT, "B09", DECIMAL, 10u, 29u, "cycles of exception exit") \
    X(TAIL_CHAIN, "B09", DECIMAL, 6u, 7u, "cycles of a tail-chain") \
    X(PPB_READ, "B09", DECIMAL, 0u, 1u, "waits of a read of the NVIC") \
    X(TIMER_PERIOD, "B10", DECIMAL, 1000u, 1001u, "cycles of a timer period of 1000") \
    X(TIMER_RESTARTS, "B10", DECIMAL, 0u, 1u, "a second write of CTRL restarts it") \
    X(TIM64_MODE, "B10", HEX, ONE(0u), "TIM64_MODE") \
    X(INTERRUPTS, "B11", DECIMAL, ONE(7u), "interrupts that came once when raised") \
    X(QUIET, "B11", DECIMAL, ONE(0u), "interrupts 8, 9 by themselves") \
    X(PWM_RATE, "B11", DECIMAL, 198u, 202u, "interrupts 34 in 10 ms at 20 kHz") \
    X(AWAKE, "B12", DECIMAL, 999000u, 1001000u, "timer ticks in 10^6 cycles") \
    X(ASLEEP, "B12", DECIMAL, 0u, 1000u, "cycles in a sleep of 100000 ticks") \
    X(GATE_IDENTITY, "B13", HEX, ONE(GATE_ID), "GATE.ID") \
    X(NO_AXIS, "B13", HEX, ONE(0u), "GATE.ID of an axis that is not there") \
    X(UNMAPPED, "B13", DECIMAL, ONE(1u), "an address that nothing has faults") \
    X(HELD_IDENTITY, "B13", HEX, ONE(GATE_ID), "GATE.ID, FPGA_SOFTRESET set") \
    X(HELD_NO_AXIS, "B13", HEX, ONE(0u), "of no axis, FPGA_SOFTRESET set") \
    X(ENVM_NO_ACCESS, "B14", HEX, ONE(DOCUMENTED_RESET_ENVM_STATUS), "STATUS without access") \
    X(ENVM_RESULT, "B14", DECIMAL, ONE(ENVM_DONE), "result of writing and reading a page") \
    X(ENVM_TIME, "B14", DECIMAL, 4000u, 12000u, "microseconds of programming it") \
    X(ENVM_LOAD_WAITS, "B14", DECIMAL, 4000u, 12000u, "microseconds of a load meanwhile") \
    X(ENVM_BUSY_ERROR, "B14", HEX, ONE(ENVM_STATUS_BUSY_ERROR), "STATUS b19, a command while busy") \
    X(ENVM_BUSY_CLEARED, "B14", HEX, ONE(0u), "STATUS b19, cleared") \
    X(ENVM_PAGE_STATUS, "B14", HEX, ANY, "NV_PAGE_STATUS behind it") \
    X(ENVM_WEAR, "B14", HEX, ONE(0u), "STATUS b5, worn") \
    X(LSR, "B15", HEX, ONE(DOCUMENTED_RESET_MMUART_LSR), "LSR as found") \
    X(UART_TIME, "B15", DECIMAL, 82000u, 91000u, "cycles of ten characters in the loop") \
    X(UART_BY_BYTE, "B15", HEX, ONE(0x5Au), "SR by byte, written 0x5A by word") \
    X(UART_BY_WORD, "B15", HEX, ONE(0xA5u), "SR by word, written 0xA5 by byte") \
    X(PIN_CONFIG, "B16", HEX, ONE(DOCUMENTED_RESET_GPIO_GPIO_CFG), "GPIO_CFG as found") \
    X(PIN_OUT, "B16", HEX, ONE(DOCUMENTED_RESET_GPIO_GPIO_OUT), "GPIO_OUT as found") \
    X(SOFT_CAUSE, "B17", HEX, ONE(SYSREG_CAUSE_SOFT), "RESET_SOURCE_CR after SYSRESETREQ") \
    X(SOFT_MARK, "B17", DECIMAL, ONE(1u), "a mark in .noinit is kept") \
    X(SOFT_RESETS, "B17", HEX, ONE(DOCUMENTED_WARM_SYSREG_SOFT_RESET_CR & ~BY_THE_BOARD), "SOFT_RESET_CR then") \
    X(SOFT_UART, "B17", DECIMAL, ONE(1u), "UART register as at power-on") \
    X(SOFT_TIMER, "B17", DECIMAL, ONE(1u), "timer register as at power-on") \
    X(SOFT_FABRIC, "B17", DECIMAL, ONE(1u), "fabric register as at power-on") \
    X(LOCKUP_CAUSE, "B18", HEX, ONE(SYSREG_CAUSE_LOCKUP), "RESET_SOURCE_CR after a lock-up") \
    X(WATCHDOG_CAUSE, "B18", HEX, ONE(SYSREG_CAUSE_WATCHDOG), "RESET_SOURCE_CR after the watchdog")

/* clang-format off: it takes the list for code */
#define BRINGUP_NAME(name, ...) FACT_##name,
enum fact { BRINGUP_FACTS(BRINGUP_NAME) FACTS };
/* clang-format on */
#undef BRINGUP_NAME

#endif

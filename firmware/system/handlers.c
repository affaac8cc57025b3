/* SPDX-License-Identifier: MIT */
#include "firmware/system/handlers.h"

#include <stddef.h>

#include "drivers/cortex/nvic.h"
#include "drivers/cortex/scb.h"
#include "drivers/mss/sysreg.h"
#include "drivers/mss/timer.h"
#include "firmware/control/current_loop_step.h"
#include "firmware/settings/config.h"
#include "firmware/settings/features.h"
#include "firmware/system/axes.h"
#include "firmware/system/boot.h"
#include "firmware/system/postmortem.h"
#include "startup/startup.h"

/* By constant addresses: a pointer in RAM may be what broke. */
void handlers_bridges_off(void)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        if (!axis_fabric_doubted(&axes[n])) {
            gate_disable(&FABRIC(n)->gate);
        }
    }
}

/*
 * The entry of every processor fault and of interrupts that nobody handles: bridges off before anything else, then the record,
 * then a reset, because nothing that ran can be trusted any more. Only while start-up does not trust the fabric is a bridge
 * left as the reset made it, which is off: a write to a fabric that does not answer would be the next fault.
 */
void fault_taken(const struct fault_frame *frame, uint32_t exc_return)
{
    handlers_bridges_off();
    postmortem_keep(frame, exc_return);
    scb_system_reset();
}

/*
 * On M2S005 and M2S010 traffic on FIC_0 can put bits back. That of the fabric comes back after each warm start there and does
 * not matter where the design's reset ignores it, which the fabric's identity tells.
 */
static bool block_is_lost(void)
{
    const uint32_t held = sysreg_held(BOOT_BLOCKS);
    return held == SYSREG_RESET_FABRIC ? !axis_fabric_doubted(&axes[0]) && !gate_id_ok(&FABRIC0->gate) : held != 0u;
}

/* The interrupts that should tell of it may not be wired, or may have been disabled by what they tell of. */
static void watch_device(void)
{
    if (!sysreg_plls_locked()) {
        nvic_pend(MSS_IRQ_PLL_LOCK_LOST);
    }
    if ((sysreg_edac_flags() & SYSREG_EDAC_FATAL) != 0u) {
        nvic_pend(MSS_IRQ_ECC_ERROR);
    }
    sysreg_edac_interrupts();
    if (block_is_lost()) {
        nvic_pend(BOARD_IRQ_PUT_BACK);
    }
}

/*
 * One instance of the current loop's interrupt. Axis, fabric and source are constants here, so all addresses are immediate and
 * no branch is left but the one to a fault.
 */
#define CURRENT_LOOP_HANDLER(name, axis, fabric, source) \
    void name(void) \
    { \
        if (current_loop_step(&axes[axis].loop, fabric, source)) { \
            current_loop_fault(); \
        } \
    }

CURRENT_LOOP_HANDLER(handlers_encoder_ab, 0, FABRIC0, LOOP_ENCODER)
CURRENT_LOOP_HANDLER(handlers_forced_ab, 0, FABRIC0, LOOP_FORCED)
CURRENT_LOOP_HANDLER(handlers_observer_ab, 0, FABRIC0, LOOP_OBSERVER)
CURRENT_LOOP_HANDLER(handlers_injection_ab, 0, FABRIC0, LOOP_INJECTION)

#define HALL_HANDLER(name, axis, fabric) \
    void name(void) \
    { \
        if (current_loop_step_hall(&axes[axis].loop, &axes[axis].hall, fabric)) { \
            current_loop_fault(); \
        } \
    }

HALL_HANDLER(handlers_hall_ab, 0, FABRIC0)

#define WEAKENING_HANDLER(name, axis, fabric, beyond) \
    void name(void) \
    { \
        if (current_loop_step_weakening(&axes[axis].loop, fabric, beyond)) { \
            current_loop_fault(); \
        } \
    }

WEAKENING_HANDLER(handlers_weakening_ab, 0, FABRIC0, false)
WEAKENING_HANDLER(handlers_overmodulating_ab, 0, FABRIC0, true)

/* The encoder, the way a drive spends its life, is by hand: system/current_loop_isr.S. */
const struct loop_handlers handlers_of_axis_0 = {
    .vector = &startup_vectors[STARTUP_SYSTEM_VECTORS + BOARD_IRQ_ADC],
    .handler =
        {
            [LOOP_ENCODER] = FabricIrq0_IRQHandler,
            [LOOP_FORCED] = handlers_forced_ab,
            [LOOP_OBSERVER] = FEATURE_IN(SENSORLESS) ? handlers_observer_ab : NULL,
            [LOOP_INJECTION] = FEATURE_IN(INJECTION) ? handlers_injection_ab : NULL,
            [LOOP_HALL] = FEATURE_IN(HALL) ? handlers_hall_ab : NULL,
        },
    .weakening = FEATURE_IN(WEAKENING) ? handlers_weakening_ab : NULL,
    .overmodulating = FEATURE_IN(WEAKENING) ? handlers_overmodulating_ab : NULL,
    .rippled = handlers_encoder_ab,
};

void Timer1_IRQHandler(void)
{
    mss_timer1_acknowledge();
    watch_device();
    drive_step(&axes[0]);
    if (FEATURE_IN(SCOPE)) {
        scope_step(&scope);
    }
}

/* Whatever the interrupt's own block is for, this device has no use for it. */
void I2C1_SMBus_IRQHandler(void)
{
    if (FEATURE_IN(SCOPE)) {
        scope_sample(&scope);
    }
}

void handlers_start_scope(void)
{
    scope_init(&scope, &axes[0], scoped_tick, &NVIC->ISPR[BOARD_IRQ_SCOPE / 32u], 1u << (BOARD_IRQ_SCOPE % 32u));
    nvic_priority(BOARD_IRQ_SCOPE, CONFIG_PRIORITY_SCOPE);
    nvic_enable(BOARD_IRQ_SCOPE);
}

void handlers_start_current_loop(void)
{
    axes[0].loop.handlers = &handlers_of_axis_0;
    nvic_clear_pending(BOARD_IRQ_ADC);
    nvic_priority(BOARD_IRQ_ADC, CONFIG_PRIORITY_CURRENT_LOOP);
    nvic_enable(BOARD_IRQ_ADC);
}

void handlers_start_slow_loop(void)
{
    nvic_priority(BOARD_IRQ_TICK, CONFIG_PRIORITY_SLOW_LOOP);
    nvic_enable(BOARD_IRQ_TICK);
    mss_timer1_start_periodic(BOARD_MSS_TIMER_HZ / CONFIG_SLOW_HZ);
}

void handlers_watch_device(void)
{
    sysreg_edac_watch();
    nvic_enable(MSS_IRQ_PLL_LOCK_LOST);
    nvic_enable(MSS_IRQ_FABRIC_PLL_LOCK_LOST);
    nvic_enable(MSS_IRQ_ECC_ERROR);
    if (!block_is_lost()) { /* or the design does not let go of it, and each life would end so */
        nvic_enable(BOARD_IRQ_PUT_BACK);
    }
}

/* SPDX-License-Identifier: MIT */
#include "firmware/system/handlers.h"

#include <stddef.h>

#include "drivers/cortex/nvic.h"
#include "drivers/cortex/scb.h"
#include "drivers/mss/sysreg.h"
#include "drivers/mss/timer.h"
#include "drivers/mss/watchdog.h"
#include "firmware/control/current_loop_step.h"
#include "firmware/settings/config.h"
#include "firmware/settings/features.h"
#include "firmware/system/boot.h"
#include "startup/startup.h"

/* By constant addresses: a pointer in RAM may be what broke. */
void handlers_bridges_off(void)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        if (!axis_fabric_is_untrusted(&axes[n])) {
            gate_disable(&FABRIC(n)->gate);
        }
    }
}

/*
 * The entry of every processor fault and of interrupts without a handler: bridges off first, then the record, then a reset,
 * because the program's state is unknown. While the fabric is not trusted a bridge is left as after reset, off: a write to a
 * fabric that does not respond would be the next fault.
 */
void fault_taken(const struct fault_frame *frame, uint32_t exc_return)
{
    handlers_bridges_off();
    postmortem_keep(frame, exc_return);
    scb_system_reset();
}

/*
 * On M2S005 and M2S010 traffic on FIC_0 can set reset bits again. The fabric's is set after each warm start there, and does not
 * matter if the design's reset ignores it, which reading the fabric's identity shows.
 */
static bool block_is_in_reset(void)
{
    const uint32_t held = sysreg_held(BOOT_BLOCKS);
    const uint32_t n = AXIS_COUNT > 1u && axis_fabric_is_untrusted(&axes[0]) ? AXIS_COUNT - 1u
                                                                             : 0u; /* an axis that is in the fabric */
    return held == SYSREG_RESET_FABRIC ? !axis_fabric_is_untrusted(&axes[n]) && !gate_id_ok(&FABRIC(n)->gate)
                                       : held != 0u;
}

/* Polled, because the interrupts may not be wired, or may have been disabled by the event itself. */
static void watch_device(void)
{
    if (!sysreg_plls_locked()) {
        nvic_pend(MSS_IRQ_PLL_LOCK_LOST);
    }
    if ((sysreg_edac_flags() & SYSREG_EDAC_FATAL) != 0u) {
        nvic_pend(MSS_IRQ_ECC_ERROR);
    }
    sysreg_edac_interrupts();
    watchdog_switch_on();
    if (block_is_in_reset()) {
        nvic_pend(BOARD_IRQ_PUT_BACK);
    }
}

/*
 * The current loop's interrupts: `step` says whether the sample has a fault. With one motor its addresses are constants of each
 * handler, and the only branch is the one to a fault. With two motors the entries share their code, so that all of it fits into
 * the locked cache (linker/m2s010.ld): some cycles more, always the same number.
 */
#if AXIS_COUNT == 1u
#define HANDLERS(name, step) \
    void handlers_##name(void) \
    { \
        struct axis *const a = &axes[0]; \
        struct fabric *const f = FABRIC0; \
        if (step) { \
            current_loop_fault(a); \
        } \
    }
#else
#define HANDLERS(name, step) \
    static __attribute__((noinline, section(".text.handlers_" #name))) void name(struct axis *a, struct fabric *f) \
    { \
        if (step) { \
            current_loop_fault(a); \
        } \
    } \
    void handlers_##name(void) \
    { \
        name(&axes[0], FABRIC0); \
    } \
    void handlers_##name##_1(void) \
    { \
        name(&axes[1], FABRIC(1)); \
    }
#endif

HANDLERS(encoder_ab, current_loop_step(&a->loop, f, LOOP_ENCODER))
HANDLERS(forced_ab, current_loop_step(&a->loop, f, LOOP_FORCED))
HANDLERS(observer_ab, current_loop_step(&a->loop, f, LOOP_OBSERVER))
HANDLERS(injection_ab, current_loop_step(&a->loop, f, LOOP_INJECTION))
HANDLERS(hall_ab, current_loop_step_hall(&a->loop, &a->hall, f))
HANDLERS(weakening_ab, current_loop_step_weakening(&a->loop, f, false))
HANDLERS(overmodulating_ab, current_loop_step_weakening(&a->loop, f, true))

/* The encoder's handler, the usual one, is hand-written: system/current_loop_isr.S. */
#define HANDLERS_OF(irq, by_hand, suffix) \
    { \
        .vector = &startup_vectors[STARTUP_SYSTEM_VECTORS + (irq)], \
        .handler = \
            { \
                [LOOP_ENCODER] = by_hand, \
                [LOOP_FORCED] = handlers_forced_ab##suffix, \
                [LOOP_OBSERVER] = FEATURE_IN(SENSORLESS) ? handlers_observer_ab##suffix : NULL, \
                [LOOP_INJECTION] = FEATURE_IN(INJECTION) ? handlers_injection_ab##suffix : NULL, \
                [LOOP_HALL] = FEATURE_IN(HALL) ? handlers_hall_ab##suffix : NULL, \
            }, \
        .weakening = FEATURE_IN(WEAKENING) ? handlers_weakening_ab##suffix : NULL, \
        .overmodulating = FEATURE_IN(WEAKENING) ? handlers_overmodulating_ab##suffix : NULL, \
        .rippled = handlers_encoder_ab##suffix, \
    }

const struct loop_handlers handlers_of_axes[AXIS_COUNT] = {
    HANDLERS_OF(BOARD_IRQ_ADC, FabricIrq0_IRQHandler, ),
#if AXIS_COUNT == 2u
    HANDLERS_OF(BOARD_IRQ_ADC_2, FabricIrq1_IRQHandler, _1),
#endif
};

/*
 * Two axes take alternate interrupts, half a millisecond apart: in the same one, the second would begin when the first is done,
 * with jitter, and count conversions wrongly.
 */
static struct axis *axis_of_tick(void)
{
    struct axis *const last = &axes[AXIS_COUNT - 1u];
    return AXIS_COUNT > 1u && last->time_ms != axes[0].time_ms ? last : &axes[0]; /* each step counts a millisecond */
}

void Timer1_IRQHandler(void)
{
    struct axis *const a = axis_of_tick();
    mss_timer1_acknowledge();
    if (a == &axes[0]) {
        watch_device();
    }
    drive_step(a);
    if (FEATURE_IN(SCOPE) && scope.axis == a) {
        scope_step(&scope);
    }
}

/* Raised by software: its own peripheral, I2C_1, is not used. */
void I2C1_SMBus_IRQHandler(void)
{
    if (FEATURE_IN(SCOPE)) {
        scope_sample(&scope);
    }
}

void handlers_start_scope(void)
{
    scope_init(&scope, &axes[0], scoped_tick, &NVIC->ISPR[BOARD_IRQ_SCOPE / 32u], 1u << (BOARD_IRQ_SCOPE % 32u));
    scope.ram = (uint32_t)(uintptr_t)link_data_start;
    scope.ram_end = (uint32_t)(uintptr_t)link_ram_end;
    nvic_priority(BOARD_IRQ_SCOPE, CONFIG_PRIORITY_SCOPE);
    nvic_enable(BOARD_IRQ_SCOPE);
}

void handlers_start_current_loop(uint32_t axis)
{
    current_loop_install(&axes[axis].loop, &handlers_of_axes[axis]);
    if (axis == 0u) {
        nvic_clear_pending(BOARD_IRQ_ADC);
        nvic_priority(BOARD_IRQ_ADC, CONFIG_PRIORITY_CURRENT_LOOP);
        nvic_enable(BOARD_IRQ_ADC);
    } else {
        nvic_clear_pending(BOARD_IRQ_ADC_2);
        nvic_priority(BOARD_IRQ_ADC_2, CONFIG_PRIORITY_CURRENT_LOOP);
        nvic_enable(BOARD_IRQ_ADC_2);
    }
}

void handlers_start_slow_loop(void)
{
    nvic_priority(BOARD_IRQ_TICK, CONFIG_PRIORITY_SLOW_LOOP);
    nvic_enable(BOARD_IRQ_TICK);
    mss_timer1_start_periodic(BOARD_MSS_TIMER_HZ / (CONFIG_SLOW_HZ * AXIS_COUNT));
}

void handlers_watch_device(void)
{
    sysreg_edac_watch();
    nvic_enable(MSS_IRQ_PLL_LOCK_LOST);
    nvic_enable(MSS_IRQ_FABRIC_PLL_LOCK_LOST);
    nvic_enable(MSS_IRQ_ECC_ERROR);
    if (!block_is_in_reset()) { /* else the design holds it, and each run would end here */
        nvic_enable(BOARD_IRQ_PUT_BACK);
    }
}

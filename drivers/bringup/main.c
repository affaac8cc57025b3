/* SPDX-License-Identifier: MIT */
#include "drivers/bringup/bringup.h"
#include "drivers/bringup/measure.h"
#include "drivers/cortex/dwt.h"
#include "drivers/cortex/scb.h"
#include "drivers/mss/gpio.h"
#include "drivers/mss/timer.h"
#include "drivers/mss/watchdog.h"
#include "startup/startup.h"

#define BAUD  115200u
#define MAGIC 0x42310001u

/* What outlives a reset has to lie somewhere. */
static STARTUP_NOINIT struct bringup kept;

static const struct step {
    const char *name;
    void (*run)(struct bringup *b);
} steps[] = {
    {"B01", step_core},       {"B02", step_causes},       {"B03", step_clocks},      {"B04", step_memory},
    {"B05", step_watchdog},   {"B06", step_esram},        {"B07", step_envm_cycles}, {"B08", step_fic},
    {"B09", step_exceptions}, {"B10", step_timer},        {"B11", step_interrupts},  {"B12", step_sleep},
    {"B13", step_fabric},     {"B14", step_envm},         {"B15", step_uart},        {"B16", step_pins},
    {"B17", step_soft_reset}, {"B18", step_other_resets}, {"B19", step_by_hand},     {"B20", step_can_bus},
};
#define STEPS (sizeof steps / sizeof steps[0])

_Static_assert(STEPS <= 32u, "a bit of not_ended each");

/* Holds its own address, at which the core's code bus finds it. */
static const void *const self = &self;

static struct found look(void)
{
    struct found found = {
        .causes = SYSREG->RESET_SOURCE_CR,
        .resets = SYSREG->SOFT_RESET_CR,
        .edac_cr = SYSREG->EDAC_CR,
        .edac_irq = SYSREG->EDAC_IRQ_ENABLE,
        .edac_sr = SYSREG->EDAC_SR,
        .envm_status = ENVM->STATUS,
        .lsr = MMUART0->LSR,
        .pin_config = GPIO->GPIO_CFG[0],
        .pin_out = GPIO->GPIO_OUT,
        .uart = MMUART0->IER,
        .timer = MSS_TIMER->TIM1_LOADVAL,
    };
    DEMCR |= DEMCR_TRCENA;
    found.dwt_ctrl = DWT->CTRL;
    (void)dwt_init();
    found.uncached_cycles = measure_chase_from_esram(self);
    return found;
}

static void open(void)
{
    static struct mmuart console; /* this image has no use for its buffers */
    (void)mmuart_init(&console, MMUART0, BAUD);
    sysreg_enable_cache();
    scb_enable_faults();
    mss_timer2_start_free_running();
    sysreg_release_reset(SYSREG_RESET_FABRIC); /* any reset but power-on holds it */
}

static void clear_causes(void)
{
    (void)sysreg_reset_cause();
}

/* A reset amid the page leads to the next step, unless the step has asked for it; one behind the page is what B18 waits for. */
static bool resumes(const struct found *now)
{
    if (kept.magic != MAGIC || (now->causes & SYSREG_CAUSE_POWER_ON) != 0u) {
        return false;
    }
    return !kept.page_done || (now->causes & (SYSREG_CAUSE_LOCKUP | SYSREG_CAUSE_WATCHDOG)) != 0u;
}

static void begin(const struct found *now)
{
    kept = (struct bringup){.magic = MAGIC, .found = *now};
    report_title();
}

static void resume(const struct found *now)
{
    kept.again = *now;
    if (kept.page_done) {
        const bool locked_up = (now->causes & SYSREG_CAUSE_LOCKUP) != 0u;
        report(&kept, locked_up ? FACT_LOCKUP_CAUSE : FACT_WATCHDOG_CAUSE, now->causes);
        clear_causes();
    } else if (!kept.reset_expected) {
        report_not_ended(&kept, steps[kept.next].name, now->causes);
        clear_causes();
        kept.next++;
    }
    kept.exception = 0u;
}

static void play(void)
{
    for (; kept.next < STEPS; kept.next++) {
        watchdog_refresh();
        steps[kept.next].run(&kept);
    }
    kept.page_done = true;
    report_verdict(&kept);
}

/* For good: the keys that B18 and B19 have named. The watchdog's is that nobody refreshes it any more. */
static _Noreturn void obey(void)
{
    bool refreshes = true;
    for (;;) {
        if (refreshes) {
            watchdog_refresh();
        }
        if ((MMUART0->LSR & MMUART_LSR_DR) != 0u) {
            const uint32_t key = MMUART0->RBR;
            refreshes = refreshes && key != 'w';
            if (key == 'l') {
                lock_up();
            } else if (key == 't') {
                ten_seconds();
            }
        }
    }
}

int main(void)
{
    const struct found now = look();
    open();
    if (resumes(&now)) {
        resume(&now);
    } else {
        begin(&now);
    }
    play();
    obey();
}

/* A fault that no step waits for ends it. */
void fault_taken(const struct fault_frame *frame, uint32_t exc_return)
{
    (void)frame;
    (void)exc_return;
    kept.exception = startup_exception_number();
    scb_system_reset();
}

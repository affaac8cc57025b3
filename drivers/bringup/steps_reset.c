/* SPDX-License-Identifier: MIT */
/* What a reset leaves, and what the image asks for: B17 to B19. */
#include "drivers/bringup/bringup.h"
#include "drivers/cortex/scb.h"
#include "drivers/fabric/fabric.h"
#include "drivers/mss/timer.h"

#define MARK         0x5EED5EEDu
#define OTHER_TICKS  0x1234u
#define OTHER_COUNTS 1234u /* of half a period */

static void change_and_reset(struct bringup *b)
{
    MMUART0->IER = MMUART_IER_ELSI;
    MSS_TIMER->TIM1_LOADVAL = OTHER_TICKS;
    if (fabric_is_ours()) {
        FABRIC0->pwm.PERIOD = OTHER_COUNTS;
    }
    b->mark = MARK;
    b->reset_expected = true;
    scb_system_reset();
}

static uint32_t same(uint32_t value, uint32_t other)
{
    return value == other ? 1u : 0u;
}

void step_soft_reset(struct bringup *b)
{
    if (!b->reset_expected) {
        change_and_reset(b);
    }
    b->reset_expected = false;
    report(b, FACT_SOFT_CAUSE, b->again.causes);
    report(b, FACT_SOFT_MARK, same(b->mark, MARK));
    report(b, FACT_SOFT_RESETS, b->again.resets & ~BY_THE_BOARD);
    report(b, FACT_SOFT_UART, same(b->again.uart, b->found.uart));
    report(b, FACT_SOFT_TIMER, same(b->again.timer, b->found.timer));
    report(b, FACT_SOFT_FABRIC, fabric_is_ours() ? same(FABRIC0->pwm.PERIOD, b->found.fabric) : 0u);
    (void)sysreg_reset_cause();
}

void step_other_resets(struct bringup *b)
{
    (void)b;
    report_text("B18", "press l, later w: the core locks up; nobody refreshes the watchdog. Each adds a line here.");
}

void step_by_hand(struct bringup *b)
{
    (void)b;
    report_text("B19", "by hand: press the reset button (DEVRST_N): this page begins anew, as at power-on.");
    report_text("B19", "by hand: volts at the gates' pins, device erased, and while it is programmed: ____ ____");
    report_text("B19", "by hand: the image came by OpenOCD, J-Link or Libero: ____");
    report_text("B19", "by hand: press t: two lines, 10 s apart by this device. By your clock: ____ s");
}

void step_can_bus(struct bringup *b)
{
    (void)b;
    report_text("B20", "by hand, the drive's image on a CAN bus at 500 kbit/s: it answers; eight frames at a halt come "
                       "in order: ____ ____");
}

/* A fault at a priority that no handler can preempt. */
_Noreturn void lock_up(void)
{
    __asm volatile("cpsid f\n\tudf #0");
    __builtin_unreachable();
}

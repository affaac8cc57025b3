/* SPDX-License-Identifier: MIT */
/* The latched fault, the drive's values at that instant, and the processor fault before the last reset. */
#include "drivers/mss/sysreg.h"
#include "firmware/operate/commands.h"
#include "firmware/operate/messages.h"

static const char *exception_name(uint32_t number)
{
    static const char *const names[] = {"thread",       "reset",     "NMI",        "hard fault",
                                        "memory fault", "bus fault", "usage fault"};
    switch (number) {
    case POSTMORTEM_MSS_PLL:
        return "the MSS PLL lost its lock";
    case POSTMORTEM_FABRIC_PLL:
        return "the fabric's PLL lost its lock";
    case POSTMORTEM_ECC:
        return "a memory error that cannot be corrected";
    case POSTMORTEM_PUT_BACK:
        return "a block was put back into reset: traffic on FIC_0, or the design";
    default:
        return number < sizeof names / sizeof names[0] ? names[number] : "unexpected interrupt";
    }
}

/* Power-on sets all bits: nothing to report. */
static void put_causes(struct text *t, uint32_t causes)
{
    static const char *const names[] = {"power-on", "System Controller", "System Controller", "software",
                                        "lock-up",  "watchdog",          "the design",        "the design"};
    if ((causes & SYSREG_CAUSE_POWER_ON) != 0u) {
        return;
    }
    for (uint32_t n = 0; n < sizeof names / sizeof names[0]; n++) {
        if ((causes >> n & 1u) != 0u) {
            text_print(t, "last reset by: %s\n", names[n]);
        }
    }
}

void postmortem_print(struct text *t, const struct postmortem *p)
{
    put_causes(t, p->reset_causes);
    if (!p->valid) {
        return;
    }
    text_print(t, "processor exception before the last reset: %s (%d)\n", exception_name(p->exception),
               (int32_t)p->exception);
    const struct fault_frame *const f = &p->frame;
    if (p->frame_valid != 0u) {
        text_print(t, "  pc 0x%08x lr 0x%08x xpsr 0x%08x\n", f->pc, f->lr, f->xpsr);
        text_print(t, "  r0 0x%08x r1 0x%08x r2 0x%08x r3 0x%08x r12 0x%08x\n", f->r0, f->r1, f->r2, f->r3, f->r12);
    } else {
        text_put(t, "  no frame: the stack was not usable\n");
    }
    text_print(t, "  cfsr 0x%08x hfsr 0x%08x mmfar 0x%08x bfar 0x%08x exc_return 0x%08x edac 0x%08x\n", p->cfsr,
               p->hfsr, p->mmfar, p->bfar, p->exc_return, p->edac);
}

static void put_snapshot(struct text *out, const struct axis *a)
{
    const struct fault_snapshot *const f = &a->faults.snapshot;
    text_print(out, "at: %.3llu s, state %s\n", (unsigned long long)f->up_ms, message_of_state(f->state));
    text_print(out, "phase currents: a %.3d A, b %.3d A, c %.3d A; d %.3d A, q %.3d A\n",
               quantity_milliamp(a, f->i_a_q15), quantity_milliamp(a, f->i_b_q15), quantity_milliamp(a, f->i_c_q15),
               quantity_milliamp(a, f->i_d_q15), quantity_milliamp(a, f->i_q_q15));
    text_print(out, "bus: %.3d V, speed: %.3d rpm, angle: %d deg, gate status: 0x%08x\n",
               quantity_millivolt(a, f->vbus_q15), quantity_milli_rpm(f->speed_rpm_q4),
               (int32_t)(f->angle_u16 * 3600u / 65536u) / 10, f->gate_status);
}

static void run_fault(struct session *s, const struct arguments *unused)
{
    (void)unused;
    const struct fault_record *const record = &s->axis->faults;
    postmortem_print(&s->out, s->last_run);
    text_print(&s->out, "fault: %s\n", message_of_fault(record->cause));
    if (record->cause == FAULT_NONE) {
        return;
    }
    const char *const detail = message_fault_detail(record->cause);
    if (*detail != '\0') {
        text_put(&s->out, "found: ");
        answer_with_values(&s->out, detail, record->detail[0], record->detail[1]);
    }
    text_print(&s->out, "look at: %s\n", message_fault_hint(record->cause));
    if (!axis_fabric_is_untrusted(s->axis)) { /* else nothing was read */
        put_snapshot(&s->out, s->axis);
    }
}

/* clang-format off */
const struct command commands_fault[] = {
    {"fault", "", "first cause, what to look at, the drive's values at that instant; registers of a processor fault",
     .run = run_fault},
    {"clear", "", "clear the fault if its cause is gone", .request = drive_clear_fault},
};
/* clang-format on */

/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "axes.h"

#include <stdlib.h>
#include <string.h>

#include "cycles.h"
#include "fabric_rtl.h"
#include "irqlog.h"
#include "probes.h"
#include "qemu_api.h"
#include "rtl_motor.h"
#include "scenario.h"
#include "trace.h"

#define WINDOW_BYTES  0x400u
#define FABRIC_IRQ0   34
#define IRQ_EXCEPTION 16 /* of IRQ 0 */
#define RAD_S_TO_RPM  9.549296585513721

/* Wakes the plant at a time. Moving a timer is costly, most calls find it in place. */
struct alarm {
    struct axis *axis;
    struct vm_timer *timer;
    int64_t armed_ns; /* -1: not armed */
};

static struct axis {
    const struct axis_config *config;
    struct plant plant;
    struct alarm trigger_alarm, conversion_alarm, interrupt_alarm;
    sim_ps hold_next_interrupt, interrupt_held_until;
    bool interrupt_wanted, interrupt_blocked, interrupt_level;
    double *probe_values;
    struct trace *trace;
} axes[CONFIG_AXES_MAX];
static unsigned count;
static int apb_write_cycles;

static unsigned number_of(const struct axis *a)
{
    return (unsigned)(a - axes);
}

struct plant *axes_plant(unsigned axis)
{
    return &axes[axis].plant;
}

static sim_ps present(void)
{
    return vm_now_ns() * SIM_PS_PER_NS;
}

/* ---- the line to the core ---- */

static unsigned exception_of(const struct axis *a)
{
    return IRQ_EXCEPTION + FABRIC_IRQ0 + number_of(a);
}

static void update_interrupt(struct axis *a)
{
    bool wanted = a->plant.fabric->interrupt, rises = wanted && !a->interrupt_wanted;
    a->interrupt_wanted = wanted;
    if (rises && a->hold_next_interrupt) {
        a->interrupt_held_until = present() + a->hold_next_interrupt;
        a->hold_next_interrupt = 0;
        vm_timer_at(a->interrupt_alarm.timer, sim_to_ns_up(a->interrupt_held_until));
    }
    bool level = wanted && !a->interrupt_blocked && present() >= a->interrupt_held_until;
    if (level != a->interrupt_level) {
        a->interrupt_level = level;
        if (level) {
            irqlog_line_rose(exception_of(a), present(), a->plant.fabric->valley_at);
        }
        vm_set_interrupt(FABRIC_IRQ0 + (int)number_of(a), level);
    }
}

void axes_delay_interrupt(unsigned axis, sim_ps delay)
{
    axes[axis].hold_next_interrupt = delay;
}

void axes_block_interrupt(unsigned axis, bool blocked)
{
    axes[axis].interrupt_blocked = blocked;
}

void axes_forget_lines(void)
{
    for (unsigned k = 0; k < count; k++) {
        axes[k].interrupt_level = true;
    }
}

/* ---- keeping the plants at the present ---- */

static void set_alarm(struct alarm *alarm, sim_ps when)
{
    int64_t when_ns = when == SIM_NEVER ? -1 : sim_to_ns_up(when);
    if (when_ns == alarm->armed_ns) {
        return;
    }
    alarm->armed_ns = when_ns;
    if (when_ns < 0) {
        vm_timer_stop(alarm->timer);
    } else {
        vm_timer_at(alarm->timer, when_ns);
    }
}

/* Both alarms are set a period ahead: a timer that becomes the earliest of all makes QEMU wake the sleeping core for nothing,
 * and with these two in turn neither does. */
static void changed(struct axis *a)
{
    update_interrupt(a);
    set_alarm(&a->trigger_alarm, plant_next_trigger(&a->plant));
    set_alarm(&a->conversion_alarm, plant_next_conversion_end(&a->plant));
}

/* Before axis 0 goes on, those whose carriers wait for its own. */
static void let_followers_catch_up(const struct axis *a)
{
    for (unsigned k = 1; a == axes && k < count; k++) {
        if (plant_waits(&axes[k].plant)) {
            plant_advance(&axes[k].plant, present());
        }
    }
}

/* When axis 0 has changed, the time at which they will start may be another. */
static void changed_with_followers(struct axis *a)
{
    changed(a);
    for (unsigned k = 1; a == axes && k < count; k++) {
        if (plant_waits(&axes[k].plant)) {
            changed(&axes[k]);
        }
    }
}

static void wake(void *woken)
{
    struct alarm *alarm = woken;
    alarm->armed_ns = -1;
    let_followers_catch_up(alarm->axis);
    plant_advance(&alarm->axis->plant, present());
    changed_with_followers(alarm->axis);
}

void axes_sync(void)
{
    for (unsigned k = count; k-- > 0;) {
        plant_advance(&axes[k].plant, present());
    }
}

void axes_changed(void)
{
    for (unsigned k = 0; k < count; k++) {
        changed(&axes[k]);
    }
}

void axes_reset_fabric(void)
{
    for (unsigned k = 0; k < count; k++) {
        plant_reset_fabric(&axes[k].plant);
    }
}

/* ---- registers ---- */

static struct axis *axis_at(uint32_t offset)
{
    return offset / WINDOW_BYTES < count ? &axes[offset / WINDOW_BYTES] : NULL;
}

uint32_t axes_read(uint32_t offset)
{
    struct axis *a = axis_at(offset);
    if (!a) {
        return 0;
    }
    let_followers_catch_up(a);
    uint32_t value = plant_read(&a->plant, offset % WINDOW_BYTES, present());
    changed_with_followers(a);
    return value;
}

void axes_write(uint32_t offset, uint32_t value)
{
    struct axis *a = axis_at(offset);
    if (!a) {
        return;
    }
    let_followers_catch_up(a);
    plant_write(&a->plant, offset % WINDOW_BYTES, value, present());
    changed_with_followers(a);
    if (offset % WINDOW_BYTES == PWM_COMPARE_C_OFFSET) {
        irqlog_pwm_written(exception_of(a), cycles_sampled(AXES_FABRIC_BASE + offset) + 1 + (uint64_t)apb_write_cycles);
    }
}

/* ---- what is recorded ---- */

static void read_probes(struct axis *a)
{
    probes_read(a->config->probes, a->config->probe_count, a->probe_values);
}

static void record(void *context, const struct plant_row *row)
{
    struct axis *a = context;
    read_probes(a);
    trace_complete_row(a->trace, a->probe_values);
    trace_row(a->trace, row);
    scenario_look(number_of(a), a->probe_values, row->t_s);
}

static void report_one(struct axis *a, FILE *progress)
{
    const struct plant *p = &a->plant;
    double i_a[3];
    motor_currents(&p->motor, i_a);
    fprintf(progress, " speed=%.0f rpm i_a=%.2f A i_q=%.2f A bus=%.1f V", p->motor.speed_rad_s * RAD_S_TO_RPM, i_a[0],
            p->motor.i_q_a, p->inverter.bus_v);
    read_probes(a);
    for (size_t n = 0; n < a->config->probe_count; n++) {
        const char *name = a->config->probes[n].name;
        if (strstr(name, "state") || strstr(name, "fault")) {
            fprintf(progress, " %s=%g", name, a->probe_values[n]);
        }
    }
}

void axes_report(FILE *progress)
{
    fprintf(progress, "t=%.3f s", sim_to_s(axes[0].plant.now));
    for (unsigned k = 0; k < count; k++) {
        if (k > 0) {
            fprintf(progress, "; axis %u:", k + 1);
        }
        report_one(&axes[k], progress);
    }
    fputc('\n', progress);
}

void axes_complete_rows(void)
{
    for (unsigned k = 0; k < count; k++) {
        read_probes(&axes[k]);
        trace_complete_row(axes[k].trace, axes[k].probe_values);
    }
}

void axes_flush(void)
{
    for (unsigned k = 0; k < count; k++) {
        trace_flush(axes[k].trace);
    }
}

/* ---- putting it together ---- */

static void init_plant(struct axis *a, const struct config *config)
{
    struct plant_params params = a->config->plant;
    params.fabric = config->fabric_path
                        ? fabric_rtl_open(config->fabric_path, &params.sensors, params.inverter.in_en != 0, params.seed)
                        : NULL;
    if (params.fabric) {
        rtl_motor_open(params.fabric, &params);
    }
    plant_init(&a->plant, &params);
    plant_join(&a->plant, number_of(a), count, a == axes ? NULL : &axes[0].plant);
    a->plant.on_trigger = record;
    a->plant.context = a;
}

void axes_init(const struct config *config)
{
    count = config->axes;
    apb_write_cycles = (int)config->cycles.apb_write;
    for (unsigned k = 0; k < count; k++) {
        struct axis *a = &axes[k];
        a->config = &config->axis[k];
        init_plant(a, config);
        a->probe_values = calloc(a->config->probe_count + 1, sizeof *a->probe_values);
        if (!a->probe_values) {
            fputs("mssfoc twin: out of memory\n", stderr);
            exit(1);
        }
        a->trace = trace_open(a->config->trace_path, a->config->csv_path, a->config->probes, a->config->probe_count);
    }
}

static void start_alarm(struct axis *a, struct alarm *alarm)
{
    *alarm = (struct alarm){a, vm_timer_new(wake, alarm), -1};
}

void axes_start(void)
{
    for (unsigned k = 0; k < count; k++) {
        start_alarm(&axes[k], &axes[k].trigger_alarm);
        start_alarm(&axes[k], &axes[k].conversion_alarm);
        start_alarm(&axes[k], &axes[k].interrupt_alarm);
    }
}

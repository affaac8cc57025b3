/* SPDX-License-Identifier: MIT */
/*
 * On and off, set-points of speed, torque and position, the source of the angle, the present state; measuring the motor,
 * learning cogging and the Hall switches.
 */
#include "drivers/mss/sysreg.h"
#include "firmware/monitor/device.h"
#include "firmware/operate/commands.h"
#include "firmware/operate/messages.h"
#include "firmware/source/rotor.h"
#include "firmware/source/sensorless.h"
#include "firmware/system/idle.h"

/* ---- status ---- */

static void put_position(struct text *out, const struct drive_status *now)
{
    text_print(out, "mode: %s, position: %d", message_of_mode(now->mode), now->position);
    if (axis_mode_is_position(now->mode)) {
        text_print(out, ", target %d, following error %d", now->target, now->error_counts);
    }
    text_print(out, " counts%s\n", now->homed ? ", homed" : "");
}

/* The first harmonics are the largest. */
static void print_cogging(struct text *out, const struct axis *a)
{
    const struct cogging_map *const m = &a->motion.cogging;
    if (a->mode == AXIS_MODE_LEARNING) {
        text_put(out, "cogging: learning\n");
    } else if (m->count > 0) {
        text_put(out, "cogging: learned, times a turn:");
        for (int32_t n = 0; n < m->count; n++) {
            text_print(out, " %d", (int32_t)m->harmonics[n].order);
        }
        text_put(out, "\n");
    }
}

static void put_bus_and_heat(struct text *out, const struct axis *a, const struct drive_status *now)
{
    text_print(out, "bus: %.3d V, winding: %d degC", quantity_millivolt(a, now->vbus_q15), a->thermal.winding_q4 / 16);
    if (a->thermal.factor_q15 < Q15_ONE) {
        text_print(out, ", current limit held to %d %%", a->thermal.factor_q15 * 100 / Q15_ONE);
    }
    text_put(out, "\n");
}

static void put_warnings(struct text *out, const struct axis *a)
{
    for (uint32_t cause = 0; cause < FAULT_COUNT; cause++) {
        if (fault_warned(&a->reports, (enum fault)cause)) {
            text_print(out, "warning: %s\n", message_of_fault((enum fault)cause));
        }
    }
}

/* Counted by the newest voltage of each millisecond, since the last `on`. */
static void put_update(struct text *out, const struct axis *a)
{
    text_print(out, "PWM update: %s%s", message_of_update(a->tuning.update),
               a->tuning.samples == 2 ? ", two samples a period" : "");
    if (a->tuning.update == PWM_UPDATE_ONCE) {
        text_print(out, ", milliseconds in which one had to wait for the next end: %d", (int32_t)a->loop.fell_back);
    }
    text_put(out, "\n");
}

static const char *leader(const struct axis *a)
{
    if (!rotor_is_known(a)) {
        return ", a prescribed field leads";
    }
    return injection_leads(a) ? ", the injection leads" : ", the observer leads";
}

/* The result of the saliency test, if it was run, and why the injection was refused. */
static void put_saliency(struct text *out, const struct injection_start *m)
{
    if (m->detail_q8 != 0) {
        text_print(out, "saliency: %.3d LSB a degree%s%s\n", m->detail_q8 * 1000 / 256,
                   m->result == INJECTION_SALIENCY ? ", too little: injection refused" : "",
                   m->result == INJECTION_POLARITY ? ", north pole not found: injection refused" : "");
    }
}

/*
 * Without an encoder: what the Hall switches show; or how well the EMF shows the rotor, and whether the EMF, the saliency or a
 * prescribed field leads.
 */
static void put_source(struct text *out, const struct axis *a)
{
    if (rotor_has_encoder(a)) {
        return;
    }
    if (rotor_has_hall(a)) {
        text_print(out, "Hall switches: %d\n", (int32_t)encoder_hall_latched(&a->fabric->encoder));
        return;
    }
    text_print(out, "margin of observability: %.3d%s\n", (int32_t)((int64_t)a->loop.flux.margin_q8 * 1000 / 256),
               leader(a));
    put_saliency(out, &a->injection);
}

static void run_status(struct session *s, const struct arguments *unused)
{
    (void)unused;
    const struct axis *const a = s->axis;
    struct text *const out = &s->out;
    const struct drive_status now = drive_status(a);
    const bool starts = now.state == AXIS_READY || now.state == AXIS_SWITCHED_ON;
    text_print(out, starts ? "state: %s (%s)\n" : "state: %s\n", message_of_state(now.state),
               message_of_phase(a->start.phase));
    text_print(out, "fault: %s\n", message_of_fault(now.fault));
    text_print(out, "commanded by: %s\n", message_of_owner(a->owner.who));
    text_print(out, "speed: %.3d rpm, reference %.3d rpm\n", quantity_milli_rpm(now.speed_rpm_q4),
               quantity_milli_rpm(now.speed_ref_rpm_q4));
    put_position(out, &now);
    print_cogging(out, a);
    text_print(out, "current: d %.3d A, q %.3d A, reference d %.3d A, q %.3d A\n", quantity_milliamp(a, now.i_d_q15),
               quantity_milliamp(a, now.i_q_q15), quantity_milliamp(a, now.i_d_ref_q15),
               quantity_milliamp(a, now.i_q_ref_q15));
    put_bus_and_heat(out, a, &now);
    if (FEATURE_IN(IDENTIFY) && a->identify.running) {
        text_print(out, "identify: step '%s'\n", identify_step_name(a->identify.step));
    }
    put_warnings(out, a);
    text_print(out, "current loop: %d cycles\n", (int32_t)measure_current_loop_cycles(&a->time_ms));
    put_update(out, a);
    put_source(out, a);
    const uint32_t watchdog_ms = device_watchdog_ms();
    if (watchdog_ms == 0u) {
        text_put(out, "watchdog: off\n");
    } else {
        text_print(out, "watchdog: %.3u s\n", watchdog_ms);
    }
    text_print(out, "memory errors corrected: %d\n", (int32_t)sysreg_edac_corrected());
    text_print(out, "up: %.3llu s\n", (unsigned long long)now.up_ms);
}

/* ---- on, and another source ---- */

/* Serves the buses while the axis prepares what was requested; false when it has. */
static bool is_preparing(struct session *s)
{
    const bool more = drive_prepare(s->axis);
    if (more) {
        text_yield(&s->out);
    }
    return more;
}

/* A full battery, or v_max_mv too close to the bus voltage. */
static void warn_of_bus(struct session *s)
{
    const int32_t bus_q15 = s->axis->loop.vbus_q15;
    if (bus_q15 * 100 >= s->axis->switching.tuning.v_max_q15 * TUNING_BUS_SET_PERCENT) {
        const int32_t bus_mv = quantity_millivolt(s->axis, bus_q15);
        text_print(&s->out,
                   "warning: bus at %.3d V: the windings must burn what braking returns; v_max_mv %d leaves room\n",
                   bus_mv, bus_mv + bus_mv / 20);
    }
}

static void run_on(struct session *s, const struct arguments *a)
{
    (void)a;
    struct outcome outcome = drive_switch_on(s->axis);
    if (outcome.error == ERROR_NONE) {
        owner_take(s->axis, OWNER_CONSOLE);
        while (is_preparing(s)) {
        }
        outcome = s->axis->switching.outcome;
    }
    answer(s, outcome);
    if (outcome.error == ERROR_NONE) {
        text_print(&s->out, "phase margin of the current loop: %d degrees\n",
                   s->axis->switching.tuning.current_margin_u16 * 360 / 65536);
        warn_of_bus(s);
    }
}

static void run_take(struct session *s, const struct arguments *a)
{
    (void)a;
    owner_take_over(s->axis, OWNER_CONSOLE);
    answer(s, OUTCOME_OK);
}

static void run_angle(struct session *s, const struct arguments *a)
{
    struct outcome outcome = drive_change_source(s->axis, (uint32_t)a->value[1]);
    if (outcome.error == ERROR_NONE) {
        while (s->axis->handover.under_way && is_preparing(s)) {
        }
        outcome = s->axis->handover.outcome;
    }
    answer(s, outcome);
}

/* ---- positions, homing ---- */

static void run_position(struct session *s, const struct arguments *a)
{
    answer(s, drive_command_position(s->axis, a->value[1], false));
}

static void run_position_by(struct session *s, const struct arguments *a)
{
    answer(s, drive_command_position(s->axis, a->value[2], true));
}

static void run_home(struct session *s, const struct arguments *a)
{
    answer(s, drive_command_home(s->axis, a->value[1] == 0 ? HOMING_INDEX : HOMING_BLOCK));
}

/* ---- the rows ---- */

/* clang-format off */
const struct command commands_drive[] = {
    {"status", "", "state, fault, speed, currents, bus voltage of one instant; memory errors; time since the start",
     .run = run_status},
    {"on", "", "calibrate, align if needed, enable operation", .run = run_on, .begins = PROGRESS_ON},
    {"take", "", "take over from another line: the motion continues, and the other line is refused from now on",
     .run = run_take},
};

const struct command commands_motion[] = {
    {"off", "", "bridge off within a millisecond, the motor coasts", .request = drive_switch_off},
    {"quickstop", "", "brake to standstill, then off; during a start off at once", .request = drive_quick_stop},
    {"speed", " RPM", "speed control to RPM", {ARGUMENT_RPM}, .demand = drive_command_speed},
    {"torque", " A", "current control, q axis, peak amperes", {ARGUMENT_AMPERES}, .demand = drive_command_current},
    {"pv", " RPM", "profile velocity: the same as speed", {ARGUMENT_RPM}, .demand = drive_command_speed},
};

const struct command commands_position[] = {
    {"pp", " COUNTS", "profile position: to COUNTS from the zero, also during another move",
     {ARGUMENT_COUNTS}, .run = run_position, .begins = PROGRESS_MOVE},
    {"pp", " by COUNTS", "relative to the last target", {ARGUMENT_BY, ARGUMENT_COUNTS},
     .run = run_position_by, .begins = PROGRESS_MOVE},
    {"hm", " index|block", "homing: search for the encoder's index or a mechanical block, which then is position 0",
     {ARGUMENT_CHOICE}, .run = run_home, .begins = PROGRESS_HOME},
    {"csp", " COUNTS", "cyclic synchronous position: there in cyclic_ms, when the next set-point is due",
     {ARGUMENT_COUNTS}, .demand = drive_command_cyclic_position},
};

const struct command commands_zero[] = {
    {"zero", "", "the shaft's position is 0 from now on", .request = drive_set_zero, .owner_only = true},
};

const struct command commands_cyclic[] = {
    {"csv", " RPM", "cyclic synchronous velocity", {ARGUMENT_RPM}, .demand = drive_command_cyclic_speed},
    {"cst", " A", "cyclic synchronous torque, q axis, peak amperes",
     {ARGUMENT_AMPERES}, .demand = drive_command_cyclic_current},
};
/* clang-format on */

_Static_assert(PARAM_ANGLE_ENCODER == 0 && PARAM_ANGLE_SENSORLESS == 1 && PARAM_ANGLE_HALL == 2, "the row's choices");

/* clang-format off */
const struct command commands_angle[] = {
    {"angle", " encoder|observer|hall",
     "change the source of the rotor's angle, while it turns; 'on' begins with angle_source",
     {ARGUMENT_CHOICE}, .run = run_angle, .owner_only = true},
    {"forget", "", "the angle between encoder and magnets, while off: the next 'on' aligns", .request = drive_forget},
};
/* clang-format on */

/* ==== identify and learn ==== */

#define RESULT_OF(NAME, ...)   [IDENTIFY_##NAME] = {__VA_ARGS__},
#define REFUSAL_OF(NAME, text) [IDENTIFY_##NAME] = text,

static const struct {
    const char *name, *unit;
    int32_t milli; /* thousandths of the unit per LSB */
} identify_quantities[IDENTIFY_QUANTITIES] = {IDENTIFY_RESULTS(RESULT_OF)};

static const char *const identify_reasons[IDENTIFY_REASONS] = {"", IDENTIFY_REFUSALS(REFUSAL_OF)};

static void put_result(struct text *out, uint32_t what, const struct identify_result *r)
{
    const int32_t milli = identify_quantities[what].milli;
    text_print(out, "%s: ", identify_quantities[what].name);
    if (r->state == IDENTIFY_KNOWN && r->interval == 0) {
        text_print(out, "%d, exactly\n", r->value);
    } else if (r->state == IDENTIFY_KNOWN) {
        text_print(out, "%.3d +-%.3d%s\n", r->value * milli, r->interval * milli, identify_quantities[what].unit);
    } else if (r->state == IDENTIFY_REFUSED) {
        text_print(out, "refused: %s\n", r->reason < IDENTIFY_REASONS ? identify_reasons[r->reason] : "unknown");
    } else {
        text_put(out, "not measured yet\n");
    }
}

/* How it ended, then a line for each quantity: value, interval and unit, or why not. */
static void put_results(struct text *out, const struct identify *d)
{
    if (d->step == IDENTIFY_STEP_NONE) {
        text_put(out, "identify has not run\n");
        return;
    }
    if (!d->running && d->fault != FAULT_NONE) {
        text_print(out, "ended in step '%s' by a fault: %s\n", identify_step_name(d->stopped_in),
                   message_of_fault((enum fault)d->fault));
    } else if (!d->running && d->stopped_in != IDENTIFY_STEP_DONE) {
        text_print(out, "ended in step '%s'\n", identify_step_name(d->stopped_in));
    }
    for (uint32_t what = 0; what < IDENTIFY_QUANTITIES; what++) {
        put_result(out, what, &d->results[what]);
    }
    text_print(out, "time: %.3d s\n", (int32_t)d->total_ms);
}

static void run_identify_results(struct session *s, const struct arguments *a)
{
    if (a->value[1] == 0) {
        put_results(&s->out, &s->axis->identify);
        return;
    }
    const struct outcome outcome = drive_identify_use(s->axis);
    answer(s, outcome);
    if (outcome.error == ERROR_NONE) {
        text_print(&s->out, "%d parameters changed; 'get all' lists them, 'on' takes them\n", outcome.value);
    }
}

/* clang-format off */
const struct command commands_identify[] = {
    {"identify", "", "measure the motor, then off; needs the inverter's ratings and i_rated_ma only",
     .request = drive_identify, .begins = PROGRESS_IDENTIFY},
    {"identify", " show|use", "what it found, with intervals; or make parameters of what is known",
     {ARGUMENT_CHOICE}, .run = run_identify_results},
};
/* clang-format on */

static void run_learn(struct session *s, const struct arguments *a)
{
    answer(s, a->value[1] == 0 ? drive_learn_cogging(s->axis) : drive_learn_hall(s->axis));
}

/* clang-format off */
const struct command commands_learn[] = {
    {"learn", " cogging|hall",
     "turn slowly in both directions and record cogging torque against position; or, while off, the edges of the Hall switches",
     {ARGUMENT_CHOICE}, .run = run_learn, .begins = PROGRESS_LEARN},
};
/* clang-format on */

/* SPDX-License-Identifier: MIT */
#include <stddef.h>

#include "drivers/mss/sysreg.h"
#include "firmware/monitor/device.h"
#include "firmware/operate/answers.h"
#include "firmware/operate/commands_parts.h"
#include "firmware/operate/identify_text.h"
#include "firmware/operate/messages.h"
#include "firmware/operate/postmortem_text.h"
#include "firmware/source/injection_lead.h"
#include "firmware/source/rotor.h"
#include "firmware/system/measure.h"

static void put_heat(struct session *s)
{
    text_put(&s->out, ", winding: ");
    text_put_int(&s->out, s->axis->thermal.winding_q4 / 16);
    text_put(&s->out, " degC");
    if (s->axis->thermal.factor_q15 < Q15_ONE) {
        text_put(&s->out, ", current limit held to ");
        text_put_int(&s->out, s->axis->thermal.factor_q15 * 100 / Q15_ONE);
        text_put(&s->out, " %");
    }
    text_put_line(&s->out, "");
}

static void put_warnings(struct session *s)
{
    for (uint32_t cause = 0; cause < FAULT_COUNT; cause++) {
        if (fault_warned(&s->axis->reports, (enum fault)cause)) {
            text_put(&s->out, "warning: ");
            text_put_line(&s->out, message_of_fault((enum fault)cause));
        }
    }
}

/* Looks at the newest voltage of each millisecond, since the last `on`. */
static void put_update(struct session *s)
{
    text_put(&s->out, "voltages act: ");
    text_put(&s->out, message_of_update(s->axis->tuning.update));
    if (s->axis->tuning.samples == 2) {
        text_put(&s->out, ", two samples a period");
    }
    if (s->axis->tuning.update == PWM_UPDATE_ONCE) {
        text_put(&s->out, ", milliseconds in which one had to wait for the next end: ");
        text_put_int(&s->out, (int32_t)s->axis->loop.fell_back);
    }
    text_put_line(&s->out, "");
}

static void put_position(struct session *s, const struct drive_status *now)
{
    text_put(&s->out, "mode: ");
    text_put(&s->out, message_of_mode(now->mode));
    text_put(&s->out, ", position: ");
    text_put_long(&s->out, now->position);
    if (axis_mode_is_position(now->mode)) {
        text_put(&s->out, ", target ");
        text_put_long(&s->out, now->target);
        text_put(&s->out, ", following error ");
        text_put_int(&s->out, now->error_counts);
    }
    text_put(&s->out, " counts");
    text_put_line(&s->out, now->homed ? ", homed" : "");
}

/* The first harmonics are the largest. */
static void put_cogging(struct session *s)
{
    const struct cogging_map *const m = &s->axis->motion.cogging;
    if (s->axis->mode == AXIS_MODE_LEARNING) {
        text_put_line(&s->out, "cogging: learning");
        return;
    }
    if (m->count == 0) {
        return;
    }
    text_put(&s->out, "cogging: learned, times a turn:");
    for (int32_t n = 0; n < m->count; n++) {
        text_put(&s->out, " ");
        text_put_int(&s->out, (int32_t)m->harmonics[n].order);
    }
    text_put_line(&s->out, "");
}

static const char *leader(const struct axis *a)
{
    if (!rotor_is_known(a)) {
        return ", a prescribed field leads";
    }
    return injection_leads(a) ? ", the injection leads" : ", the observer leads";
}

/* The result of the saliency test, if it was run, and why it was not good enough. */
static void put_saliency(struct session *s)
{
    const struct injection_start *const m = &s->axis->injection;
    if (m->detail_q8 == 0) {
        return;
    }
    text_put(&s->out, "saliency: ");
    text_put_milli(&s->out, m->detail_q8 * 1000 / 256);
    text_put(&s->out, " LSB a degree");
    text_put(&s->out, m->result == INJECTION_SALIENCY ? ", too little: injection refused" : "");
    text_put_line(&s->out, m->result == INJECTION_POLARITY ? ", north pole not found: injection refused" : "");
}

/*
 * Without an encoder: what the Hall switches show; or how well the EMF shows the rotor, and whether the EMF, the saliency or a
 * prescribed field leads.
 */
static void put_margin(struct session *s)
{
    const struct axis *const a = s->axis;
    if (rotor_has_encoder(a)) {
        return;
    }
    if (rotor_has_hall(a)) {
        text_put(&s->out, "Hall switches: ");
        text_put_int(&s->out, (int32_t)encoder_hall_latched(&a->fabric->encoder));
        text_put_line(&s->out, "");
        return;
    }
    text_put(&s->out, "margin of observability: ");
    text_put_milli(&s->out, (int32_t)((int64_t)a->loop.flux.margin_q8 * 1000 / 256));
    text_put_line(&s->out, leader(a));
    put_saliency(s);
}

static void put_watchdog(struct session *s)
{
    const uint32_t ms = device_watchdog_ms();
    text_put(&s->out, "watchdog: ");
    if (ms == 0u) {
        text_put_line(&s->out, "off");
        return;
    }
    text_put_seconds(&s->out, ms);
    text_put_line(&s->out, " s");
}

void run_status(struct session *s, char *const *words)
{
    (void)words;
    const struct drive_status now = drive_status(s->axis);
    const int32_t i_range_ma = s->axis->params.i_range_ma;
    text_put(&s->out, "state: ");
    text_put_line(&s->out, message_of_state(now.state));
    text_put(&s->out, "fault: ");
    text_put_line(&s->out, message_of_fault(now.fault));
    answer_rpm(s, "speed: ", now.speed_rpm_q4);
    answer_rpm(s, ", reference ", now.speed_ref_rpm_q4);
    text_put_line(&s->out, "");
    put_position(s, &now);
    put_cogging(s);
    answer_milli(s, "current: d ", now.i_d_q15, i_range_ma, " A");
    answer_milli(s, ", q ", now.i_q_q15, i_range_ma, " A");
    answer_milli(s, ", reference d ", now.i_d_ref_q15, i_range_ma, " A");
    answer_milli(s, ", q ", now.i_q_ref_q15, i_range_ma, " A");
    text_put_line(&s->out, "");
    answer_milli(s, "bus: ", now.vbus_q15, s->axis->params.v_range_mv, " V");
    put_heat(s);
    identify_text_running(&s->out, &s->axis->identify);
    put_warnings(s);
    text_put(&s->out, "current loop: ");
    text_put_int(&s->out, (int32_t)measure_current_loop_cycles(&s->axis->time_ms));
    text_put_line(&s->out, " cycles");
    put_update(s);
    put_margin(s);
    put_watchdog(s);
    text_put(&s->out, "memory errors corrected: ");
    text_put_int(&s->out, (int32_t)sysreg_edac_corrected());
    text_put_line(&s->out, "");
    text_put(&s->out, "up: ");
    text_put_seconds(&s->out, now.up_ms);
    text_put_line(&s->out, " s");
}

static void put_detail(struct session *s)
{
    const char *const text = message_fault_detail(s->axis->faults.cause);
    if (*text != '\0') {
        text_put(&s->out, "found: ");
        answer_filled(s, text, s->axis->faults.detail[0], s->axis->faults.detail[1]);
    }
}

void run_fault(struct session *s, char *const *words)
{
    (void)words;
    const struct axis *const a = s->axis;
    postmortem_print(&s->out, s->last_life);
    text_put(&s->out, "fault: ");
    text_put_line(&s->out, message_of_fault(a->faults.cause));
    if (a->faults.cause == FAULT_NONE) {
        return;
    }
    put_detail(s);
    text_put(&s->out, "look at: ");
    text_put_line(&s->out, message_fault_hint(a->faults.cause));
    if (axis_fabric_doubted(a)) {
        return; /* there was nothing to read */
    }
    const struct fault_snapshot *const f = &a->faults.snapshot;
    text_put(&s->out, "at: ");
    text_put_seconds(&s->out, f->up_ms);
    text_put(&s->out, " s, state ");
    text_put_line(&s->out, message_of_state(f->state));
    answer_milli(s, "phase currents: a ", f->i_a_q15, a->params.i_range_ma, " A");
    answer_milli(s, ", b ", f->i_b_q15, a->params.i_range_ma, " A");
    answer_milli(s, ", c ", f->i_c_q15, a->params.i_range_ma, " A");
    answer_milli(s, "; d ", f->i_d_q15, a->params.i_range_ma, " A");
    answer_milli(s, ", q ", f->i_q_q15, a->params.i_range_ma, " A");
    text_put_line(&s->out, "");
    answer_milli(s, "bus: ", f->vbus_q15, a->params.v_range_mv, " V");
    answer_rpm(s, ", speed: ", f->speed_rpm_q4);
    text_put(&s->out, ", angle: ");
    text_put_int(&s->out, (int32_t)(f->angle_u16 * 3600u / 65536u) / 10);
    text_put(&s->out, " deg, gate status: ");
    text_put_hex(&s->out, f->gate_status);
    text_put_line(&s->out, "");
}

/* SPDX-License-Identifier: MIT */
#include "firmware/operate/modbus_values.h"

#include "firmware/settings/config.h"
#include "lib/q15.h"

#define DEVICE_TYPE 0x00020192u
#define PRODUCT     0x6D666F63u
#define DRIVE_MODES 0x3ADu /* pp, pv, tq, hm, csp, csv, cst */

static int32_t milli_rpm(int32_t rpm_q4)
{
    return (int32_t)((int64_t)rpm_q4 * 1000 / 16);
}

static int32_t milliamp(const struct modbus_view *v, int32_t q15)
{
    return tuning_milli_from_q15(q15, v->axis->params.i_range_ma);
}

static int32_t millivolt(const struct modbus_view *v, int32_t q15)
{
    return tuning_milli_from_q15(q15, v->axis->params.v_range_mv);
}

static int32_t per_mille_of_rated(const struct modbus_view *v, int32_t q15)
{
    const int64_t per_mille = (int64_t)milliamp(v, q15) * 1000 / v->axis->params.i_rated_ma;
    return (int32_t)q15_clamp((int32_t)(per_mille > INT16_MAX ? INT16_MAX : per_mille), INT16_MIN, INT16_MAX);
}

/* "1.2.3" as 0x00010203. */
static uint32_t revision(void)
{
    uint32_t number = 0;
    uint32_t part = 0;
    for (const char *c = CONFIG_VERSION; *c != '\0'; c++) {
        if (*c == '.') {
            number = (number | part) << 8;
            part = 0;
        } else {
            part = part * 10u + (uint32_t)(*c - '0');
        }
    }
    return number | part;
}

static uint32_t wish(const struct modbus_view *v, enum modbus_object_id object)
{
    const struct cia402_wishes *const w = &v->cia402->wishes;
    switch (object) {
    case OBJECT_control_word:
        return w->control_word;
    case OBJECT_mode:
        return (uint32_t)w->mode;
    case OBJECT_target_velocity:
        return (uint32_t)w->target_rpm;
    case OBJECT_target_position:
        return (uint32_t)w->target_counts;
    case OBJECT_target_torque:
        return (uint32_t)w->target_torque_pm;
    case OBJECT_homing_method:
        return (uint32_t)w->homing_method;
    case OBJECT_angle_source:
        return v->axis->tuning.angle_source;
    default:
        return 0; /* store and restore: what they can do, which is nothing */
    }
}

static uint32_t present(const struct modbus_view *v, enum modbus_object_id object)
{
    const struct drive_status *const now = &v->now;
    switch (object) {
    case OBJECT_status_word:
        return cia402_status_word(v->cia402, v->axis, now);
    case OBJECT_mode_display:
        return (uint32_t)cia402_mode_display(v->cia402, now);
    case OBJECT_velocity:
        return (uint32_t)milli_rpm(now->speed_rpm_q4);
    case OBJECT_position:
        return (uint32_t)now->position;
    case OBJECT_torque:
        return (uint32_t)per_mille_of_rated(v, now->i_q_q15);
    case OBJECT_error_code:
        return cia402_error_code((enum fault)now->fault);
    case OBJECT_velocity_demand:
        return (uint32_t)milli_rpm(now->speed_ref_rpm_q4);
    case OBJECT_following_error:
        return axis_mode_is_position(now->mode) ? (uint32_t)now->error_counts : 0u;
    case OBJECT_bus_voltage:
        return (uint32_t)millivolt(v, now->vbus_q15);
    case OBJECT_current_d:
        return (uint32_t)milliamp(v, now->i_d_q15);
    case OBJECT_current_q:
        return (uint32_t)milliamp(v, now->i_q_q15);
    case OBJECT_winding_temperature:
        return (uint32_t)(v->axis->thermal.winding_q4 / 16);
    case OBJECT_current_limit:
        return (uint32_t)(v->axis->thermal.factor_q15 * 1000 / Q15_ONE);
    case OBJECT_warnings:
        return v->axis->reports.warned[0];
    case OBJECT_warnings_2:
        return v->axis->reports.warned[1];
    case OBJECT_uptime:
        return (uint32_t)(now->up_ms / 1000u);
    case OBJECT_fault:
        return now->fault;
    case OBJECT_refusal:
        return v->cia402->refusal.error;
    default: /* OBJECT_refusal_value */
        return (uint32_t)v->cia402->refusal.value;
    }
}

static uint32_t past(const struct modbus_view *v, enum modbus_object_id object)
{
    const struct fault_record *const r = &v->axis->faults;
    const struct fault_snapshot *const s = &r->snapshot;
    switch (object) {
    case OBJECT_fault_cause:
        return v->now.fault;
    case OBJECT_fault_state:
        return s->state;
    case OBJECT_fault_detail_1:
        return (uint32_t)r->detail[0];
    case OBJECT_fault_detail_2:
        return (uint32_t)r->detail[1];
    case OBJECT_fault_time:
        return (uint32_t)s->up_ms;
    case OBJECT_fault_current_a:
        return (uint32_t)milliamp(v, s->i_a_q15);
    case OBJECT_fault_current_b:
        return (uint32_t)milliamp(v, s->i_b_q15);
    case OBJECT_fault_current_c:
        return (uint32_t)milliamp(v, s->i_c_q15);
    case OBJECT_fault_current_d:
        return (uint32_t)milliamp(v, s->i_d_q15);
    case OBJECT_fault_current_q:
        return (uint32_t)milliamp(v, s->i_q_q15);
    case OBJECT_fault_bus_voltage:
        return (uint32_t)millivolt(v, s->vbus_q15);
    case OBJECT_fault_velocity:
        return (uint32_t)milli_rpm(s->speed_rpm_q4);
    case OBJECT_fault_gate_status:
        return s->gate_status;
    default: /* OBJECT_fault_angle */
        return s->angle_u16 * 3600u / 65536u;
    }
}

static uint32_t identity(const struct modbus_view *v, enum modbus_object_id object)
{
    switch (object) {
    case OBJECT_device_type:
        return DEVICE_TYPE;
    case OBJECT_product:
        return PRODUCT;
    case OBJECT_revision:
        return revision();
    case OBJECT_drive_modes:
        return DRIVE_MODES;
    case OBJECT_rated_current:
        return (uint32_t)v->axis->params.i_rated_ma;
    case OBJECT_max_velocity:
        return (uint32_t)v->axis->params.speed_max_rpm;
    case OBJECT_map_version:
        return MODBUS_MAP_VERSION;
    case OBJECT_parameter_count:
        return (uint32_t)param_count;
    default: /* vendor and serial number */
        return 0;
    }
}

uint32_t modbus_value(const struct modbus_view *v, enum modbus_object_id object)
{
    if (object < OBJECT_status_word || object >= OBJECT_store) {
        return wish(v, object);
    }
    if (object < OBJECT_fault_cause) {
        return present(v, object);
    }
    return object < OBJECT_device_type ? past(v, object) : identity(v, object);
}

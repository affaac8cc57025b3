/* SPDX-License-Identifier: MIT */
/*
 * The objects that Modbus shows besides parameters and reactions, those of CiA 402 (IEC 61800-7-201) and CiA 301 among them:
 * the one table from which firmware, docs/modbus.md and tests take addresses, types, units and values.
 */
#ifndef FIRMWARE_OPERATE_MODBUS_OBJECTS_H
#define FIRMWARE_OPERATE_MODBUS_OBJECTS_H

#include <stdbool.h>
#include <stdint.h>

/* clang-format off */
/*
 * Register, index in CiA 402 or 301, type, access, name, unit, what; and the value: for RO out of one instant of the drive
 * (`axis`, `now`, `past`: the snapshot of its fault, `cia402`), for RW a member of what may be written (`w`).
 */
#define MODBUS_OBJECTS(X) \
    X(0x0000, 0x6040, U16, RW, control_word, "", "commands to the state machine", w->setpoints.control_word) \
    X(0x0001, 0x6060, I16, RW, mode, "", "1 pp, 3 pv, 4 tq, 6 hm, 8 csp, 9 csv, 10 cst", w->setpoints.mode) \
    X(0x0002, 0x60FF, I32, RW, target_velocity, "rpm", "of pv and csv; at most speed_max_rpm", w->setpoints.target_rpm) \
    X(0x0004, 0x607A, I32, RW, target_position, "counts", "of pp and csp", w->setpoints.target_counts) \
    X(0x0006, 0x6071, I16, RW, target_torque, "0.1 %", "of tq and cst; of i_rated_ma, at most i_max_ma", \
      w->setpoints.target_torque_pm) \
    X(0x0007, 0x6098, I16, RW, homing_method, "", "34 index, -1 mechanical block, both towards home_rpm; 37 here", \
      w->setpoints.homing_method) \
    X(0x0008, 0, U16, RW, angle_source, "", "in effect: 0 encoder, 1 observer, 2 Hall; written: takes over while it turns", \
      w->source) \
    X(0x0010, 0x6041, U16, RO, status_word, "", "the state machine", cia402_status_word(cia402, axis, now)) \
    X(0x0011, 0x6061, I16, RO, mode_display, "", "the mode in effect; -1 learns cogging", cia402_mode_display(cia402, now)) \
    X(0x0012, 0x606C, I32, RO, velocity, "0.001 rpm", "measured", quantity_milli_rpm(now->speed_rpm_q4)) \
    X(0x0014, 0x6064, I32, RO, position, "counts", "measured; wraps", now->position) \
    X(0x0016, 0x6077, I16, RO, torque, "0.1 %", "q current of i_rated_ma", per_mille_of_rated(axis, now->i_q_q15)) \
    X(0x0017, 0x603F, U16, RO, error_code, "", "of the latched fault, 0 if there is none", \
      cia402_error_code((enum fault)now->fault)) \
    X(0x0018, 0x606B, I32, RO, velocity_demand, "0.001 rpm", "behind the ramp", quantity_milli_rpm(now->speed_ref_rpm_q4)) \
    X(0x001A, 0x60F4, I32, RO, following_error, "counts", "reference less shaft, in pp and csp", \
      axis_mode_is_position(now->mode) ? now->error_counts : 0) \
    X(0x001C, 0x6079, U32, RO, bus_voltage, "mV", "measured", quantity_millivolt(axis, now->vbus_q15)) \
    X(0x001E, 0, I32, RO, current_d, "mA", "measured, peak", quantity_milliamp(axis, now->i_d_q15)) \
    X(0x0020, 0, I32, RO, current_q, "mA", "measured, peak", quantity_milliamp(axis, now->i_q_q15)) \
    X(0x0022, 0, I16, RO, winding_temperature, "degC", "estimated or measured", axis->thermal.winding_q4 / 16) \
    X(0x0023, 0, U16, RO, current_limit, "0.1 %", "of i_max_ma that heat leaves", axis->thermal.factor_q15 * 1000 / Q15_ONE) \
    X(0x0024, 0, U32, RO, warnings, "", "since enabling: a bit for each fault number from 0", axis->reports.warned[0]) \
    X(0x0026, 0, U32, RO, warnings_2, "", "the same from 32", axis->reports.warned[1]) \
    X(0x0028, 0, U32, RO, uptime, "s", "since the start", now->up_ms / 1000u) \
    X(0x002A, 0, U16, RO, fault, "", "number of the latched fault", now->fault) \
    X(0x002B, 0, U16, RO, refusal, "", "why the last command was refused; 0: it was not", cia402->refusal.error) \
    X(0x002C, 0, I32, RO, refusal_value, "", "what would work, where the refusal names a number", cia402->refusal.value) \
    X(0x0040, 0, U16, RO, fault_cause, "", "snapshot: number of the fault", now->fault) \
    X(0x0041, 0, U16, RO, fault_state, "", "axis state when it came", past->state) \
    X(0x0042, 0, I32, RO, fault_detail_1, "", "what it has to tell (docs/faults.md)", axis->faults.detail[0]) \
    X(0x0044, 0, I32, RO, fault_detail_2, "", "", axis->faults.detail[1]) \
    X(0x0046, 0, U32, RO, fault_time, "ms", "since the start; wraps in 49.7 days", past->up_ms) \
    X(0x0048, 0, I32, RO, fault_current_a, "mA", "phase A", quantity_milliamp(axis, past->i_a_q15)) \
    X(0x004A, 0, I32, RO, fault_current_b, "mA", "phase B", quantity_milliamp(axis, past->i_b_q15)) \
    X(0x004C, 0, I32, RO, fault_current_c, "mA", "phase C", quantity_milliamp(axis, past->i_c_q15)) \
    X(0x004E, 0, I32, RO, fault_current_d, "mA", "", quantity_milliamp(axis, past->i_d_q15)) \
    X(0x0050, 0, I32, RO, fault_current_q, "mA", "", quantity_milliamp(axis, past->i_q_q15)) \
    X(0x0052, 0, U32, RO, fault_bus_voltage, "mV", "", quantity_millivolt(axis, past->vbus_q15)) \
    X(0x0054, 0, I32, RO, fault_velocity, "0.001 rpm", "", quantity_milli_rpm(past->speed_rpm_q4)) \
    X(0x0056, 0, U32, RO, fault_gate_status, "", "register GATE.STATUS (docs/fabric.md)", past->gate_status) \
    X(0x0058, 0, U16, RO, fault_angle, "0.1 deg", "of the field, electrical", past->angle_u16 * 3600u / 65536u) \
    X(0x0080, 0x1000, U32, RO, device_type, "", "0x00020192: a servo drive of CiA 402", DEVICE_TYPE) \
    X(0x0082, 0x1018, U32, RO, vendor, "", "0: none is registered", 0) \
    X(0x0084, 0x1018, U32, RO, product, "", "0x6D666F63", PRODUCT) \
    X(0x0086, 0x1018, U32, RO, revision, "", "of the firmware: major, minor, patch, a byte each", revision()) \
    X(0x0088, 0x1018, U32, RO, serial, "", "0: none is kept", 0) \
    X(0x008A, 0x6502, U32, RO, drive_modes, "", "a bit for each mode less one", DRIVE_MODES) \
    X(0x008C, 0x6075, U32, RO, rated_current, "mA", "i_rated_ma, what torques are relative to", axis->params.i_rated_ma) \
    X(0x008E, 0x6080, U32, RO, max_velocity, "rpm", "speed_max_rpm", axis->params.speed_max_rpm) \
    X(0x0090, 0, U16, RO, map_version, "", "of this table; 1", MODBUS_MAP_VERSION) \
    X(0x0091, 0, U16, RO, parameter_count, "", "from 0x1000 on, two registers each", param_count) \
    X(0x00C0, 0x1010, U32, RW, store, "", "0x65766173 stores what is set, as `save` does; answered when it is stored", \
      w->store) \
    X(0x00C2, 0x1011, U32, RW, restore, "", "0x64616F6C makes all parameters the initial ones, in RAM; store then keeps them", \
      w->restore)

#define OBJECT_ID(at, index, type, access, name, unit, what, value) OBJECT_##name,
enum modbus_object_id {
    MODBUS_OBJECTS(OBJECT_ID)
    OBJECT_COUNT
};
#undef OBJECT_ID
/* clang-format on */

enum modbus_type {
    MODBUS_U16,
    MODBUS_I16,
    MODBUS_U32, /* two registers, the high one first */
    MODBUS_I32,
};

struct modbus_object {
    uint16_t at; /* its first register */
    uint8_t type;
    bool writable;
};

extern const struct modbus_object modbus_objects[OBJECT_COUNT];

/* Parameters in the order of param_table, two registers each; reactions to faults by fault number. */
#define MODBUS_REACTIONS 0x0400u
#define MODBUS_PARAMS    0x1000u

#define MODBUS_MAP_VERSION 1
#define MODBUS_SAVE        0x65766173u /* "save", least significant letter first: CiA 301 */
#define MODBUS_LOAD        0x64616F6Cu

#endif

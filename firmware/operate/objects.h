/* SPDX-License-Identifier: MIT */
/*
 * The objects that the buses show besides parameters and reactions, those of CiA 402 (IEC 61800-7-201) and CiA 301 among them:
 * the one table from which firmware, docs/modbus.md, the EDS and tests take addresses, types, units and values.
 */
#ifndef FIRMWARE_OPERATE_OBJECTS_H
#define FIRMWARE_OPERATE_OBJECTS_H

#include <stdbool.h>
#include <stdint.h>

/* clang-format off */
/*
 * Modbus register, index and subindex in CiA 402 or 301 (0: CANopen has it at 0x2000 + the register), type, access, name,
 * unit, what; and the value: for RO out of one instant of the drive (`axis`, `now`, `past`: the snapshot of its fault,
 * `cia402`), for RW a member of what may be written (`w`).
 */
#define OBJECTS(X) \
    X(0x0000, 0x604000, U16, RW, control_word, "", "commands to the state machine", w->setpoints.control_word) \
    X(0x0001, 0x606000, I8, RW, mode, "", "1 pp, 3 pv, 4 tq, 6 hm, 8 csp, 9 csv, 10 cst", w->setpoints.mode) \
    X(0x0002, 0x60FF00, I32, RW, target_velocity, "rpm", "of pv and csv; at most speed_max_rpm", w->setpoints.target_rpm) \
    X(0x0004, 0x607A00, I32, RW, target_position, "counts", "of pp and csp; the nearest place with these bits", \
      w->setpoints.target_counts) \
    X(0x0006, 0x607100, I16, RW, target_torque, "0.1 %", "of tq and cst; of i_rated_ma, at most i_max_ma", \
      w->setpoints.target_torque_pm) \
    X(0x0007, 0x609800, I8, RW, homing_method, "", "34 index, -1 mechanical block, both towards home_rpm; 37 here", \
      w->setpoints.homing_method) \
    X(0x0008, 0, U16, RW, angle_source, "", "in effect: 0 encoder, 1 observer, 2 Hall; written: takes over while it turns", \
      w->source) \
    X(0x0009, 0, U16, RW, owner, "", "who commands: 0 nobody, 1 console, 2 Modbus, 3 CAN; one's own number takes over", \
      w->owner) \
    X(0x000C, 0x607E00, U8, RW, polarity, "", "parameter direction: 0x00, or 0xC0, position and velocity turned together", \
      w->polarity) \
    X(0x0010, 0x604100, U16, RO, status_word, "", "the state machine", cia402_status_word(cia402, axis, now)) \
    X(0x0011, 0x606100, I8, RO, mode_display, "", "the mode in effect; -1 learns cogging", cia402_mode_display(cia402, now)) \
    X(0x0012, 0x606C00, I32, RO, velocity, "0.001 rpm", "measured", quantity_milli_rpm(now->speed_rpm_q4)) \
    X(0x0014, 0x606400, I32, RO, position, "counts", "measured; wraps", now->position) \
    X(0x0016, 0x607700, I16, RO, torque, "0.1 %", "q current of i_rated_ma", per_mille_of_rated(axis, now->i_q_q15)) \
    X(0x0017, 0x603F00, U16, RO, error_code, "", "of the latched fault, 0 if there is none", \
      cia402_error_code((enum fault)now->fault)) \
    X(0x0018, 0x606B00, I32, RO, velocity_demand, "0.001 rpm", "behind the ramp", quantity_milli_rpm(now->speed_ref_rpm_q4)) \
    X(0x001A, 0x60F400, I32, RO, following_error, "counts", "reference less shaft, in pp and csp", \
      axis_mode_is_position(now->mode) ? now->error_counts : 0) \
    X(0x001C, 0x607900, U32, RO, bus_voltage, "mV", "measured", quantity_millivolt(axis, now->vbus_q15)) \
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
    X(0x0080, 0x100000, U32, RO, device_type, "", "0x00020192: a servo drive of CiA 402", OBJECTS_DEVICE) \
    X(0x0082, 0x101801, U32, RO, vendor, "", "0: none is registered", 0) \
    X(0x0084, 0x101802, U32, RO, product, "", "0x6D666F63", PRODUCT) \
    X(0x0086, 0x101803, U32, RO, revision, "", "of the firmware: major, minor, patch, a byte each", revision()) \
    X(0x0088, 0x101804, U32, RO, serial, "", "0: none is kept", 0) \
    X(0x008A, 0x650200, U32, RO, drive_modes, "", "bit n: mode n + 1, with this angle source", cia402_supported_modes(axis)) \
    X(0x008C, 0x607500, U32, RO, rated_current, "mA", "i_rated_ma, what torques are relative to", axis->params.i_rated_ma) \
    X(0x008E, 0x608000, U32, RO, max_velocity, "rpm", "speed_max_rpm", axis->params.speed_max_rpm) \
    X(0x0090, 0, U16, RO, map_version, "", "of this table; 1", MODBUS_MAP_VERSION) \
    X(0x0091, 0, U16, RO, parameter_count, "", "from 0x1000 on, two registers each", param_count) \
    X(0x00C0, 0x101001, U32, RW, store, "", "0x65766173 stores what is set, as `save` does; answered when it is stored", \
      w->store) \
    X(0x00C2, 0x101101, U32, RW, restore, "", "0x64616F6C makes parameters the initial ones, in RAM; store then keeps them", \
      w->restore)

#define OBJECT_ID(at, index, type, access, name, unit, what, value) OBJECT_##name,
enum object_id {
    OBJECTS(OBJECT_ID)
    OBJECT_COUNT
};
#undef OBJECT_ID
/* clang-format on */

enum object_type {
    OBJECT_TYPE_I8, /* on Modbus in a register of its own, like those of 16 bits */
    OBJECT_TYPE_U8, /* likewise */
    OBJECT_TYPE_U16,
    OBJECT_TYPE_I16,
    OBJECT_TYPE_U32, /* on Modbus two registers, the high one first */
    OBJECT_TYPE_I32,
};

struct object_row {
    uint16_t at;    /* its first register */
    uint16_t index; /* CANopen's */
    uint8_t subindex;
    uint8_t type; /* enum object_type */
    bool writable;
};

extern const struct object_row objects[OBJECT_COUNT];

#define OBJECTS_INDEX  0x2000u /* CANopen: where an object stands that the standards do not have; from its register on */
#define OBJECTS_SAVE   0x65766173u /* "save", least significant letter first: CiA 301 */
#define OBJECTS_LOAD   0x64616F6Cu
#define OBJECTS_TURNED 0xC0u       /* of 0x607E: bit 7 position, bit 6 velocity */
#define OBJECTS_DEVICE 0x00020192u /* a servo drive of CiA 402 */

#define MODBUS_MAP_VERSION 1

#endif

/* SPDX-License-Identifier: MIT */
/*
 * The objects that the buses show besides parameters and reactions, those of CiA 402 (IEC 61800-7-201) and CiA 301 among them:
 * the one table from which firmware, docs/modbus.md, the EDS and tests take addresses, types, units and values. Then objects
 * that are other names of parameters, and how the buses read and write all of them.
 */
#ifndef FIRMWARE_OPERATE_OBJECTS_H
#define FIRMWARE_OPERATE_OBJECTS_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/drive/drive.h"
#include "firmware/operate/cia402.h"
#include "firmware/settings/params.h"
#include "firmware/settings/slots.h"

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
    X(0x0018, 0x606B00, I32, RO, velocity_demand, "0.001 rpm", "after the ramp", quantity_milli_rpm(now->speed_ref_rpm_q4)) \
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

/* ==== other names of parameters ==== */

/*
 * Objects of CiA 402 that map to parameters, for masters that write them at boot. Firmware and EDS take them from this table;
 * docs/can.md has the parameter of each. Written only while the drive is off, as parameters.
 */
/* How it follows from parameters. PROFILE_FIXED: always `fixed`; other values are refused. */
enum profile_how {
    PROFILE_FIXED,
    PROFILE_RAMP,      /* ramp_rpm_s; a write also sets profile_rpm_s to it */
    PROFILE_QUICK,     /* four times that, the deceleration of a quick stop: at most */
    PROFILE_SPEED,     /* profile_speed_pm of speed_max_rpm */
    PROFILE_HOME,      /* magnitude of home_rpm */
    PROFILE_FOLLOWING, /* following_mturn in counts */
    PROFILE_TORQUE,    /* i_max_ma in 0.1 % of i_rated_ma */
    PROFILE_CYCLE,     /* cyclic_ms in units of */
    PROFILE_EXPONENT,  /* this power of 10 seconds, -3 to 0 */
};

/* Index, subindex, type, access, name, default as in the EDS, how, value if PROFILE_FIXED. */
/* clang-format off */
#define PROFILE_OBJECTS(X) \
    X(0x605A, 0, I16, RW, "Quick stop option code", 2, FIXED, 2) \
    X(0x605B, 0, I16, RW, "Shutdown option code", 0, FIXED, 0) \
    X(0x605C, 0, I16, RW, "Disable operation option code", 0, FIXED, 0) \
    X(0x605D, 0, I16, RW, "Halt option code", 1, FIXED, 1) \
    X(0x6065, 0, U32, RW, "Following error window", 400, FOLLOWING, 0) \
    X(0x6072, 0, U16, RW, "Max torque", 1500, TORQUE, 0) \
    X(0x607D, 0, U8,  RO, "Software position limit: number", 2, FIXED, 2) \
    X(0x607D, 1, I32, RW, "Min position limit", -2147483648, FIXED, INT32_MIN) \
    X(0x607D, 2, I32, RW, "Max position limit", 2147483647, FIXED, INT32_MAX) \
    X(0x6081, 0, U32, RW, "Profile velocity", 3600, SPEED, 0) \
    X(0x6083, 0, U32, RW, "Profile acceleration", 5000, RAMP, 0) \
    X(0x6084, 0, U32, RW, "Profile deceleration", 5000, RAMP, 0) \
    X(0x6085, 0, U32, RW, "Quick stop deceleration", 20000, QUICK, 0) \
    X(0x6099, 0, U8,  RO, "Homing speeds: number", 2, FIXED, 2) \
    X(0x6099, 1, U32, RW, "Speed during search for switch", 30, HOME, 0) \
    X(0x6099, 2, U32, RW, "Speed during search for zero", 30, HOME, 0) \
    X(0x609A, 0, U32, RW, "Homing acceleration", 5000, RAMP, 0) \
    X(0x60C2, 0, U8,  RO, "Interpolation time period: number", 2, FIXED, 2) \
    X(0x60C2, 1, U8,  RW, "Interpolation time period value", 10, CYCLE, 0) \
    X(0x60C2, 2, I8,  RW, "Interpolation time index", -3, EXPONENT, 0)
/* clang-format on */

struct profile_object {
    uint16_t index;
    uint8_t subindex, type, how; /* enum object_type, enum profile_how */
    bool writable;
    int32_t fixed;
};

extern const struct profile_object profile_objects[];
extern const uint32_t profile_object_count;

/* ==== reading and writing ==== */

/*
 * What the buses read and write of a drive: objects, reactions to faults, parameters; each bus maps them to its addresses.
 * After a refusal nothing has changed, except that a control word that stops has been obeyed. Thread.
 */
/* A drive on one bus: each bus has its own control word and targets. */
struct bus_drive {
    struct axis *axis;
    const struct slots *slots; /* where settings are stored */
    struct cia402 cia402;
};

enum object_refusal {
    OBJECT_OK,
    OBJECT_TOO_LOW,
    OBJECT_TOO_HIGH,
    OBJECT_BAD_VALUE,
    OBJECT_NO_CODE_WORD, /* of store or restore */
    OBJECT_BAD_STATE,    /* the drive's state does not allow it */
    OBJECT_COMMANDED,    /* another line commands */
};

/* One value, by its table and row. */
struct object_place {
    enum { PLACE_NONE, PLACE_OBJECT, PLACE_REACTION, PLACE_PARAM, PLACE_PROFILE } kind;
    uint32_t number; /* enum object_id, enum fault, or row of param_table, of profile_objects */
};

enum object_type object_type(const struct object_place *p);
bool object_is_writable(const struct object_place *p);

/* The objects that may be written. */
struct object_writable {
    struct cia402_setpoints setpoints;
    uint32_t source; /* of the angle */
    uint32_t owner;  /* enum owner */
    uint32_t store, restore;
    uint32_t polarity; /* parameter direction: OBJECTS_TURNED, or 0 */
    int32_t exponent;  /* 0x60C2:2 */
};

/* Values of one instant. */
struct object_view {
    const struct axis *axis;
    const struct cia402 *cia402;
    struct drive_status now;
    struct object_writable writable;
};

struct object_view object_view(const struct bus_drive *d);

/* In the unit of the table; 32 bits of it. */
uint32_t object_get(const struct object_view *v, const struct object_place *p);

/* The drive's values after a write; applied only when all of them have been checked. */
struct object_change {
    struct params params;
    uint8_t choice[FAULT_COUNT];
    uint32_t params_changed, choices_changed;
    struct outcome absent; /* a feature one of them needs that is not in the build */
    struct object_writable writable;
    uint32_t setpoints; /* those written: a bit for each, by enum object_id */
};

/*
 * A write is a transaction: object_begin(), object_change() for each value, which checks its range, and object_commit(), which
 * also checks several parameters for consistency, as switching on does. object_check() only checks.
 */
void object_begin(struct object_change *c, const struct bus_drive *d);
enum object_refusal object_change(struct object_change *c, const struct object_place *p, int32_t value);
enum object_refusal object_check(const struct object_change *c, struct bus_drive *d);
enum object_refusal object_commit(struct object_change *c, struct bus_drive *d);

/* After a refused write: a control word in it that only stops is obeyed nevertheless. */
void object_stop(const struct object_change *c, struct bus_drive *d);

#endif

/* SPDX-License-Identifier: MIT */
/*
 * Objects of CiA 402 that are other names of parameters: what masters write at boot. From this table firmware and EDS take
 * them; docs/can.md says which parameter each is. Written while the drive is off, as parameters are.
 */
#ifndef FIRMWARE_OPERATE_PROFILE_OBJECTS_H
#define FIRMWARE_OPERATE_PROFILE_OBJECTS_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/settings/params.h"

/* How it follows from parameters; of PROFILE_FIXED it is `fixed`, and nothing else can be written. */
enum profile_how {
    PROFILE_FIXED,
    PROFILE_RAMP,      /* ramp_rpm_s; written, profile_rpm_s is the same */
    PROFILE_QUICK,     /* four times that: how a quick stop brakes; no more can be had */
    PROFILE_SPEED,     /* profile_speed_pm of speed_max_rpm */
    PROFILE_HOME,      /* home_rpm, whose sign stays */
    PROFILE_FOLLOWING, /* following_mturn in counts */
    PROFILE_TORQUE,    /* i_max_ma in 0.1 % of i_rated_ma */
    PROFILE_CYCLE,     /* cyclic_ms as so many times */
    PROFILE_EXPONENT,  /* a power of 10 of a second, -3 to 0 */
};

/* Index, subindex, type, access, name, initial value as the EDS has it, how, of PROFILE_FIXED the value. */
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

/* Its value; `exponent`: what 0x60C2:2 is. */
int32_t profile_value(const struct profile_object *o, const struct params *p, int32_t exponent);

/* Name of the parameter that it sets, NULL for what sets none; and the value that this one is to have. */
const char *profile_param(const struct profile_object *o, const struct params *p, int32_t exponent, int32_t value,
                          int32_t *wanted);

#endif

/* SPDX-License-Identifier: MIT */
/*
 * Features that a build may leave out: `make FEATURES="..."` lists those included, by default all. Calls into a feature are
 * guarded by the constant FEATURE_IN, so that compiler and linker drop unreachable code. A missing feature is refused by name
 * (ERROR_NOT_IN_BUILD).
 */
#ifndef FIRMWARE_SETTINGS_FEATURES_H
#define FIRMWARE_SETTINGS_FEATURES_H

#include <stdbool.h>

#include "firmware/settings/error.h"
#include "firmware/settings/params.h"

/* clang-format off */
#define FEATURES(X) \
    X(ENCODER, encoder)       /* angle_source 0 */ \
    X(HALL, hall)             /* angle_source 2 */ \
    X(SENSORLESS, sensorless) /* angle_source 1, and failover from encoder or Hall switches */ \
    X(INJECTION, injection)   /* at low speed, by the saliency; needs sensorless */ \
    X(WEAKENING, weakening)   /* field weakening and overmodulation */ \
    X(POSITION, position)     /* pp, hm, csp, zero */ \
    X(IDENTIFY, identify)     \
    X(LEARN, learn)           /* cogging, Hall switches */ \
    X(CONSOLE, console)       \
    X(MODBUS, modbus)         \
    X(SCOPE, scope)           \
    X(SETTINGS, settings)     /* kept in eNVM */ \
    X(CAN, can)               /* CANopen */
/* clang-format on */

#define FEATURE_OF(name, word) FEATURE_##name,

enum feature { FEATURES(FEATURE_OF) FEATURE_COUNT };

/* A bit for each; features.mk adds up those left out. */
#define FEATURE_BIT(name, word) FEATURE_LEFT_OUT_##word = 1u << FEATURE_##name,

enum { FEATURES(FEATURE_BIT) };

#ifndef FEATURES_LEFT_OUT
#define FEATURES_LEFT_OUT 0u
#endif

#define FEATURE_IS_IN(feature) ((((uint32_t)(FEATURES_LEFT_OUT) >> (feature)) & 1u) == 0u)
#define FEATURE_IN(name)       FEATURE_IS_IN(FEATURE_##name)

/* With only one source of the angle there is no change of source. */
#define FEATURE_SOURCES (FEATURE_IN(ENCODER) + FEATURE_IN(HALL) + FEATURE_IN(SENSORLESS))

#define SOURCE_BIT(name, feature, start, properties) \
    | (FEATURE_IN(feature) && ((uint32_t)(properties)&wanted) != 0u ? 1u << PARAM_ANGLE_##name : 0u)

/* A bit for each source in this build that has one of these properties. */
static inline uint32_t sources_with(uint32_t wanted)
{
    return 0u SOURCES(SOURCE_BIT);
}

/* True if a source, enum param_angle, has one of these properties. Any context. */
static inline bool source_has(uint32_t source, uint32_t wanted)
{
    const uint32_t with = sources_with(wanted);
    return with == sources_with(UINT32_MAX) || (with >> source & 1u) != 0u;
}

static inline struct outcome feature_absent(enum feature f)
{
    return (struct outcome){ERROR_NOT_IN_BUILD, (int32_t)f};
}

/* ERROR_NOT_IN_BUILD if a parameter's value needs a missing feature: any but its default. */
struct outcome features_allow(const struct param_info *info, int32_t value);

/* The same for a source of the angle, enum param_angle. */
struct outcome features_allow_source(int32_t source);

#endif

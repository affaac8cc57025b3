/* SPDX-License-Identifier: MIT */
/*
 * The sources of the rotor's angle: X(name, feature, start, properties), in the order of parameter angle_source.
 *
 *   feature     of settings/features.h, which a build may leave out
 *   start       how it starts: start_by_... of drive/start.h
 *   properties  what it can. All others ask for these (source_has(), rotor.h), never for a source by its name
 */
#ifndef FIRMWARE_SETTINGS_SOURCES_H
#define FIRMWARE_SETTINGS_SOURCES_H

enum source_property {
    SOURCE_COUNTS = 1u << 0,    /* an encoder: the shaft's position, an index, and whatever is learned by place */
    SOURCE_SWITCHES = 1u << 1,  /* Hall switches: edges at places that are learned */
    SOURCE_ESTIMATES = 1u << 2, /* no sensor: the EMF, the saliency, or a prescribed field */
    SOURCE_WEAKENS = 1u << 3,   /* its handler weakens the field, and overmodulates */
    SOURCE_CATCHES = 1u << 4,   /* its start finds the angle of a rotor that turns */
};

/* clang-format off */
#define SOURCES(X) \
    X(ENCODER, ENCODER, encoder, SOURCE_COUNTS | SOURCE_WEAKENS) \
    X(SENSORLESS, SENSORLESS, observer, SOURCE_ESTIMATES | SOURCE_CATCHES) \
    X(HALL, HALL, hall, SOURCE_SWITCHES | SOURCE_CATCHES)
/* clang-format on */

#define SOURCE_NUMBER(name, feature, start, properties) PARAM_ANGLE_##name,

enum param_angle { SOURCES(SOURCE_NUMBER) PARAM_ANGLES };

#endif

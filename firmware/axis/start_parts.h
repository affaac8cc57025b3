/* SPDX-License-Identifier: MIT */
/* The parts of a start (start.h), for each other: start_sensorless.c and
 * start_hall.c have the ways of a drive without an encoder. Slow loop. */
#ifndef FIRMWARE_AXIS_START_PARTS_H
#define FIRMWARE_AXIS_START_PARTS_H

#include "firmware/axis/axis.h"

enum start_phase {
    START_CALIBRATE,
    START_WIRING,
    START_ALIGN,
    START_FOLLOW,     /* from the prescribed field to the rotor's, for which the bridge is off for a moment */
    START_FIELD,      /* without an encoder: the rotor is to hang on a field */
    START_IDENTIFY,   /* in place of the alignment: it ends with the bridge off */
    START_CATCH,      /* without an encoder: does the rotor turn already? */
    START_DOUBT,      /* likewise: did it turn while the wiring looked wrong? */
    START_INJECTION,  /* or its saliency is to show it */
    START_HALL,       /* Hall switches tell the angle */
    START_LAY_HALL,   /* or the rotor is to hang on a field, */
    START_LEARN_HALL, /* with which their table is found: it ends with the bridge off */
};

/* The bridge on, the field's angle from `source`. */
void start_follow(struct axis *a, enum loop_source source);

/* The bridge on, and on to the wiring, or straight to operation where that is known. */
void start_open_gates(struct axis *a);

/* What is too short for an edge of a Hall switch is none. Any context but an interrupt's. */
void start_filter_hall(struct axis *a);

/* Without an encoder, the sensors' zeros known: the rotor may turn already. */
void start_sensorless(struct axis *a);

/* The wiring looks wrong: off, and the EMF says whether the rotor is driven, which would look the same. */
void start_doubt(struct axis *a, enum fault fault);

/* The wiring is right: injection, or a field on which the rotor hangs. */
void start_sensorless_wired(struct axis *a);

/* One step of these phases; true when operation may begin. */
bool start_sensorless_step(struct axis *a);

/* By Hall switches: they are followed from now on, bridge off; the sensors' zeros are known; the wiring is right. */
void start_hall_begin(struct axis *a);
void start_hall(struct axis *a);
void start_hall_wired(struct axis *a);

/* One step of these phases; true when operation may begin, or when the table is found. */
bool start_hall_step(struct axis *a);

/* Sectors since the start began. */
int32_t start_hall_moved(const struct axis *a);

/* What start_tuning() asks: a voltage is prescribed, and not regulated. */
bool start_sensorless_holds_voltage(const struct axis *a);

#endif

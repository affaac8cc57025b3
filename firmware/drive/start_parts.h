/* SPDX-License-Identifier: MIT */
/* Shared by the parts of a start (start.h): start_sensorless.c and start_hall.c start a drive without an encoder. Slow loop. */
#ifndef FIRMWARE_DRIVE_START_PARTS_H
#define FIRMWARE_DRIVE_START_PARTS_H

#include "firmware/axis/axis.h"

enum start_phase {
    START_CALIBRATE,
    START_WIRING,
    START_ALIGN,
    START_FOLLOW,     /* from the prescribed field to the rotor's; the bridge is off for a moment */
    START_FIELD,      /* without an encoder: align the rotor with a field */
    START_IDENTIFY,   /* in place of the alignment: it ends with the bridge off */
    START_CATCH,      /* without an encoder: does the rotor turn already? */
    START_DOUBT,      /* without an encoder: did it turn while the wiring looked wrong? */
    START_INJECTION,  /* without an encoder: find the rotor by its saliency */
    START_HALL,       /* Hall switches give the angle */
    START_LAY_HALL,   /* `learn hall`: align the rotor with a field, */
    START_LEARN_HALL, /* then turn it to find the table: ends with the bridge off */
};

/* Switches the bridge on, with the field's angle from `source`. */
void start_follow(struct axis *a, enum loop_source source);

/* Switches the bridge on, then continues with the wiring, or straight to operation if that is known. */
void start_open_gates(struct axis *a);

/* Sets the filter that drops pulses too short to be Hall edges. Any context but an interrupt's. */
void start_filter_hall(struct axis *a);

/* No encoder, sensor zeros known: the rotor may turn already. */
void start_sensorless(struct axis *a);

/* The wiring looks wrong: switches off, and the EMF tells whether the rotor is driven, which would look the same. */
void start_doubt(struct axis *a, enum fault fault);

/* The wiring is right: injection, or a field that the rotor follows. */
void start_sensorless_wired(struct axis *a);

/* One step of these phases; true when operation may begin. */
bool start_sensorless_step(struct axis *a);

/* With Hall switches: they are tracked from now on, bridge off; the sensor zeros are known; the wiring is right. */
void start_hall_begin(struct axis *a);
void start_hall(struct axis *a);
void start_hall_wired(struct axis *a);

/* One step of these phases; true when operation may begin, or when the table is found. */
bool start_hall_step(struct axis *a);

/* Sectors since the start began. */
int32_t start_hall_moved(const struct axis *a);

/* For start_tuning(): true if a voltage is prescribed, not regulated. */
bool start_sensorless_holds_voltage(const struct axis *a);

#endif

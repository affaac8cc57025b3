/* SPDX-License-Identifier: MIT */
/* Shared by the parts of a start (start.h): start_encoder.c, start_sensorless.c and start_hall.c, a source each. Slow loop. */
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
    START_CONFIRM,    /* a remembered offset is held against the rotor */
    START_PHASES
};

/* Switches the bridge on, with the field's angle from `source`. */
void start_follow(struct axis *a, enum loop_source source);

/* Switches the bridge on, then continues with the wiring, or straight to operation if that is known. */
void start_open_gates(struct axis *a);

/* Sets the filter that drops pulses too short to be Hall edges. Any context but an interrupt's. */
void start_filter_hall(struct axis *a);

/*
 * What a source of the angle does: each millisecond, whatever the state, and when it starts. A new one is a file with such a
 * structure, and a row of settings/params.h. Slow loop.
 */
struct start_source {
    void (*before)(struct axis *a);       /* the states: measures the speed */
    void (*after)(struct axis *a);        /* states and current loop: follows them; NULL: nothing to follow */
    void (*begin)(struct axis *a);        /* bridge off, before the sensors' zeros are measured */
    void (*calibrated)(struct axis *a);   /* zeros known: opens the gates, tries again, or raises a fault */
    void (*wired)(struct axis *a);        /* the wiring is right: the first of its phases */
    bool (*driven)(const struct axis *a); /* by a load, in the wiring's test; NULL: it does not see that */
    void (*doubt)(struct axis *a,
                  enum fault fault);             /* the wiring looks so; or is the rotor driven? NULL: it looks so */
    bool (*step)(struct axis *a);                /* one of its phases; true when operation may begin */
    bool (*holds_voltage)(const struct axis *a); /* this phase prescribes a voltage, and regulates nothing */
};

#define SOURCE_STARTS(name, feature, start, properties) extern const struct start_source start_by_##start;

SOURCES(SOURCE_STARTS)

/* Of these, what tests and other parts call by name. */
void start_sensorless_wired(struct axis *a);
bool start_sensorless_step(struct axis *a);
bool start_sensorless_holds_voltage(const struct axis *a);
void start_hall_begin(struct axis *a);
void start_hall(struct axis *a);
void start_hall_wired(struct axis *a);
bool start_hall_step(struct axis *a);

/* Sectors since the start began. */
int32_t start_hall_moved(const struct axis *a);

#endif

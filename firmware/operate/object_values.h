/* SPDX-License-Identifier: MIT */
/*
 * What the buses read and write of a drive: the objects of objects.h, reactions to faults, parameters. Where each of them
 * stands is the bus's affair. After a refusal nothing has changed, but
 * that a word which stops has. Thread.
 */
#ifndef FIRMWARE_OPERATE_OBJECT_VALUES_H
#define FIRMWARE_OPERATE_OBJECT_VALUES_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/drive/drive.h"
#include "firmware/operate/cia402.h"
#include "firmware/operate/objects.h"
#include "firmware/settings/slots.h"

/* A drive as one bus commands it: each has its own control word and targets. */
struct bus_drive {
    struct axis *axis;
    const struct slots *slots; /* where settings are stored */
    struct cia402 cia402;
};

enum object_refusal {
    OBJECT_FINE,
    OBJECT_TOO_LOW,
    OBJECT_TOO_HIGH,
    OBJECT_BAD_VALUE,
    OBJECT_NO_CODE_WORD, /* of store or restore */
    OBJECT_BAD_STATE,    /* the drive's state does not allow it */
    OBJECT_COMMANDED,    /* another line commands */
};

/* One value, wherever it comes from. */
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

/* The drive's values after a write; adopted only once all of it has been checked. */
struct object_change {
    struct params params;
    uint8_t choice[FAULT_COUNT];
    uint32_t params_changed, choices_changed;
    struct outcome absent; /* what one of them needs and the build does not have */
    struct object_writable writable;
    uint32_t setpoints; /* a bit for each that is among them, by enum object_id */
};

/*
 * A write: begun, one or several values, each of which is checked against its range, and committed, which checks several
 * parameters also together, as switching on would; object_check() does no more than that.
 */
void object_begin(struct object_change *c, const struct bus_drive *d);
enum object_refusal object_change(struct object_change *c, const struct object_place *p, int32_t value);
enum object_refusal object_check(const struct object_change *c, struct bus_drive *d);
enum object_refusal object_commit(struct object_change *c, struct bus_drive *d);

/* Of a write that was refused: a word among it that only stops is obeyed, whatever came with it. */
void object_stop(const struct object_change *c, struct bus_drive *d);

#endif

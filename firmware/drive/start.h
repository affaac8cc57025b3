/* SPDX-License-Identifier: MIT */
/*
 * From "ready" to "operation enabled": sensor zeros, rotor at rest, bridge on, wiring, alignment. Each step that fails raises
 * its own fault. A drive whose offset is known needs only the first and the third, and the wiring when the second sample of a
 * period is new to it. An offset that was known before this start is not believed unseen: commission/offset_check.h, then
 * monitor/encoder_watch.h once the EMF shows it. One that was wrong, or may have been, is forgotten.
 *
 * Hall switches give the angle at once, the middle of a sector: with them only the first `on` checks the wiring.
 *
 * The offset is known after an alignment, as long as the encoder has counted without a fault; or, once the index has been seen
 * with a known offset, whenever the index has been seen again.
 */
#ifndef FIRMWARE_DRIVE_START_H
#define FIRMWARE_DRIVE_START_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/commission/alignment.h"
#include "firmware/commission/offset_check.h"
#include "firmware/commission/wiring.h"
#include "firmware/control/current_loop.h"
#include "firmware/fault/fault.h"
#include "firmware/settings/params.h"

struct axis;

struct start {
    uint32_t phase;
    uint32_t latched; /* the encoder's, when the zero measurement began */
    uint32_t doubted; /* enum fault: what the wiring looked like, or what it may be the cause of */
    uint32_t tries;   /* how often the rotor was found turning */
    struct calibration calibration;
    struct wiring wiring;
    struct alignment alignment;
    struct offset_check check;
    bool aligned;              /* the encoder's relation to the magnets is known: angle_offset_q32 of the loop */
    bool rescaled;             /* the observer's angle still has the previous scale */
    bool index_known;          /* the index's relation is known, too */
    bool wired;                /* with Hall switches, no encoder: the wiring has been checked */
    bool remembered;           /* the offset was known before this start began */
    bool learns;               /* `learn hall`, not `on`: it ends with the bridge off */
    bool unseen;               /* what the sensors show in the second sample of a period */
    uint32_t index_offset_q32; /* the field's angle at the index */
};

/* What the source of the angle does in each millisecond, before and behind the states. Slow loop. */
void start_source_before(struct axis *a);
void start_source_after(struct axis *a);

/* Slow loop, bridge off. */
void start_begin(struct axis *a);

/* One step a millisecond; true when operation may begin. May raise a fault instead. Slow loop. */
bool start_step(struct axis *a);

/* The tuning to pass to current_loop_follow() while it starts: switched on. Slow loop. */
const struct tuning *start_tuning(const struct axis *a);

/* Learns the index's offset once the drive's offset is known. Slow loop, now and then, bridge on. */
void start_learn_index(struct axis *a);

/* The encoder's scale has changed: nothing is known any more. Thread, bridge off. */
void start_forget(struct axis *a);

/* A fault has ended operation, or the start: what was known may be wrong by it, or have caused it. Slow loop. */
void start_doubt(struct axis *a, enum fault cause);

/* ==== the parts of a start ==== */

/* Shared by start_encoder.c, start_sensorless.c and start_hall.c, a source each. Slow loop. */

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

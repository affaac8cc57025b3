/* SPDX-License-Identifier: MIT */
/*
 * From "ready" to "operation enabled": sensor zeros, rotor at rest, bridge on, wiring, alignment. Each step that fails raises
 * its own fault. A drive whose offset is known needs only sensor zeros and bridge on, and the wiring check when a second sample
 * per period is new. An offset from before this start is verified: at rest by commission/offset_check.h, then by
 * monitor/encoder_watch.h once there is enough EMF. A wrong one is discarded.
 *
 * Hall switches give the angle immediately, as the middle of a sector; only the first `on` checks the wiring.
 *
 * The offset is known after an alignment, until the encoder has a fault; or, once the index was seen with a known offset, as
 * soon as the index is seen again.
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
    uint32_t latched;   /* the encoder's, when the zero measurement began */
    uint32_t suspected; /* enum fault of the wiring test, or one that wrong wiring may have caused */
    uint32_t tries;     /* how often the rotor was found turning */
    struct calibration calibration;
    struct wiring wiring;
    struct alignment alignment;
    struct offset_check check;
    bool aligned;              /* the encoder's relation to the magnets is known: angle_offset_q32 of the loop */
    bool rescaled;             /* the observer's angle still has the previous scale */
    bool index_known;          /* the field's angle at the index is known, too */
    bool wired;                /* with Hall switches, no encoder: the wiring has been checked */
    bool remembered;           /* the offset was known before this start began */
    bool learns;               /* `learn hall`, not `on`: it ends with the bridge off */
    bool recheck_wiring;       /* the sensors' second sample of a period is untested */
    uint32_t index_offset_q32; /* the field's angle at the index */
};

/* The source's work in each millisecond, before and after the states. Slow loop. */
void start_source_before(struct axis *a);
void start_source_after(struct axis *a);

/* Slow loop, bridge off. */
void start_begin(struct axis *a);

/* One step a millisecond; true when operation may begin. May raise a fault instead. Slow loop. */
bool start_step(struct axis *a);

/* The tuning to pass to current_loop_follow() while it starts: switched on. Slow loop. */
const struct tuning *start_tuning(const struct axis *a);

/* Learns the index's offset once the drive's offset is known. Slow loop, not in every step, bridge on. */
void start_learn_index(struct axis *a);

/* Invalidates all that is known of the encoder, after a change of its scale. Thread, bridge off. */
void start_forget(struct axis *a);

/* After a fault: invalidates what it may have made wrong, or what may have caused it. Slow loop. */
void start_forget_after(struct axis *a, enum fault cause);

/* ==== the parts of a start ==== */

/* Shared by start_encoder.c, start_sensorless.c and start_hall.c, a source each. Slow loop. */

enum start_phase {
    START_CALIBRATE,
    START_WIRING,
    START_ALIGN,
    START_FOLLOW,        /* from the prescribed field to the rotor's; the bridge is off for a moment */
    START_FIELD,         /* without an encoder: align the rotor with a field */
    START_IDENTIFY,      /* in place of the alignment: it ends with the bridge off */
    START_CATCH,         /* without an encoder: does the rotor turn already? */
    START_CHECK_TURNING, /* without an encoder: did it turn while the wiring looked wrong? */
    START_INJECTION,     /* without an encoder: find the rotor by its saliency */
    START_HALL,          /* Hall switches give the angle */
    START_ALIGN_HALL,    /* `learn hall`: align the rotor with a field, */
    START_LEARN_HALL,    /* then turn it to find the table: ends with the bridge off */
    START_CONFIRM,       /* verify a remembered offset */
    START_PHASES
};

/* Switches the bridge on, with the field's angle from `source`. */
void start_follow(struct axis *a, enum loop_source source);

/* Switches the bridge on, then continues with the wiring, or straight to operation if that is known. */
void start_open_gates(struct axis *a);

/* Sets the input filter for pulses too short to be Hall edges. Any context but an interrupt's. */
void start_filter_hall(struct axis *a);

/*
 * What a source of the angle does: each millisecond, whatever the state, and when it starts. A new one is a file with such a
 * structure, and a row of settings/params.h. Slow loop.
 */
struct start_source {
    void (*before)(struct axis *a);       /* before the states: measures the speed */
    void (*after)(struct axis *a);        /* after states and current loop; may be NULL */
    void (*begin)(struct axis *a);        /* bridge off, before the sensors' zeros are measured */
    void (*calibrated)(struct axis *a);   /* zeros known: opens the gates, tries again, or raises a fault */
    void (*wired)(struct axis *a);        /* the wiring is right: the first of its phases */
    bool (*driven)(const struct axis *a); /* a load drives the rotor during the wiring test; NULL: cannot tell */
    void (*wiring_failed)(struct axis *a,
                          enum fault fault);     /* wiring fault, or is the rotor driven? NULL: raises the fault */
    bool (*step)(struct axis *a);                /* one of its phases; true when operation may begin */
    bool (*holds_voltage)(const struct axis *a); /* this phase prescribes a voltage, and regulates nothing */
};

#define SOURCE_STARTS(name, feature, start, properties) extern const struct start_source start_by_##start;

SOURCES(SOURCE_STARTS)

/* Of these, what tests and other files call by name. */
void start_sensorless_wired(struct axis *a);
bool start_sensorless_step(struct axis *a);
bool start_sensorless_holds_voltage(const struct axis *a);
void start_hall_begin(struct axis *a);
void start_hall(struct axis *a);
void start_hall_wired(struct axis *a);

#endif

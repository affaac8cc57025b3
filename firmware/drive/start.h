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
#include "firmware/fault/fault.h"

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

#endif

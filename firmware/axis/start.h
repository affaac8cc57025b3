/* SPDX-License-Identifier: MIT */
/*
 * The way from "ready" to "operation enabled": zero of the sensors, the rotor at rest, bridge on, wiring, alignment. Each step
 * that fails raises a fault with its name. A drive whose offset is known needs the first and the third only, and the wiring
 * when the second sample of a period is new to it.
 *
 * Hall switches tell the angle at once, in the middle of a sector: with them only the first `on` looks at the wiring.
 *
 * Known it is from an alignment on, as long as the encoder has counted without a fault; or, once the index has been seen with a
 * known offset, whenever the index has been seen again.
 */
#ifndef FIRMWARE_AXIS_START_H
#define FIRMWARE_AXIS_START_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/commission/alignment.h"
#include "firmware/commission/calibration.h"
#include "firmware/commission/wiring.h"

struct axis;

struct start {
    uint32_t phase;
    uint32_t latched; /* of the encoder when the zero of the sensors was begun */
    uint32_t doubted; /* enum fault: what the wiring looked like */
    uint32_t tries;   /* how often the rotor was found turning */
    struct calibration calibration;
    struct wiring wiring;
    struct alignment alignment;
    bool aligned;     /* the encoder's relation to the magnets is known: angle_offset_q32 of the loop */
    bool rescaled;    /* the observer's angle is still of the scale before */
    bool index_known; /* and that of the index */
    bool wired;       /* without an encoder, where Hall switches tell the angle: the wiring has been looked at */
    bool learns;      /* `learn hall` and not `on`: it ends with the bridge off */
    bool unseen;      /* what the sensors show in the second sample of a period */
    uint32_t index_offset_q32; /* the field's angle at the index */
};

/* Slow loop, bridge off. */
void start_begin(struct axis *a);

/* One step a millisecond; true when operation may begin. May raise a fault instead. Slow loop. */
bool start_step(struct axis *a);

/* What current_loop_follow() is to be given. Slow loop. */
const struct tuning *start_tuning(const struct axis *a);

/* Takes the offset of the index from a drive whose offset is known. Slow loop, now and then, bridge on. */
void start_learn_index(struct axis *a);

/* The encoder's scale has changed: nothing is known any more. Thread, bridge off. */
void start_forget(struct axis *a);

#endif

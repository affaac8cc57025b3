/* SPDX-License-Identifier: MIT */
/*
 * Homing: a search at constant speed for the zero of position, the encoder's index or a hard stop. The caller turns the shaft,
 * with no more current than home_pct allows; this module decides what was found.
 *
 * Index: the first pulse that starts after the search did; a given direction always sees the same edge. Hard stop: the shaft
 * stands still at the full permitted current. In a search for an index, that is a failure.
 */
#ifndef FIRMWARE_COMMISSION_HOMING_H
#define FIRMWARE_COMMISSION_HOMING_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/position.h"
#include "firmware/settings/tuning.h"

enum homing_method {
    HOMING_INDEX,
    HOMING_BLOCK,
    HOMING_METHODS,
};

enum homing_result {
    HOMING_SEARCHES,
    HOMING_FOUND,
    HOMING_FAILED,
};

struct homing {
    uint32_t method;     /* enum homing_method */
    int64_t from;        /* counts where the search began */
    int64_t counted;     /* counts when the shaft last moved by two or more */
    uint32_t blocked_ms; /* how long it has not */
    int64_t zero;        /* HOMING_FOUND: the new zero, in the old counts */
};

/* What a step sees. */
struct homing_view {
    const struct turns *turns;
    int32_t turn;     /* counts */
    int64_t farthest; /* counts: limit of the search */
    bool at_limit;    /* the current is at its limit */
    bool index_seen;  /* since the search began */
    uint32_t index;   /* and where: the counter then */
};

/* Starts here. The caller discards earlier index pulses. Slow loop, or while it is masked. */
void homing_begin(struct homing *h, enum homing_method method, const struct turns *turns);

/* One step a millisecond. Slow loop. */
enum homing_result homing_step(struct homing *h, const struct homing_view *v);

#endif

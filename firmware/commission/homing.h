/* SPDX-License-Identifier: MIT */
/*
 * Homing: a search at constant speed for what gives positions their zero, the encoder's index or a mechanical block. The
 * caller turns the shaft, with no more current than home_pct allows; here is decided what was found.
 *
 * Index: the first pulse that begins after the search has; a direction always sees the same edge of it. A block: the shaft
 * stands although it has all the current it may have. Where an index is searched for, that is a failure.
 */
#ifndef FIRMWARE_COMMISSION_HOMING_H
#define FIRMWARE_COMMISSION_HOMING_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/turns.h"
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
    uint32_t blocked_ms; /* since when it has not */
    int64_t zero;        /* HOMING_FOUND: what is to be 0 from now on, in counts until now */
};

/* What is seen in a step. */
struct homing_view {
    const struct turns *turns;
    int32_t turn;     /* counts */
    int64_t farthest; /* counts: search no farther */
    bool at_limit;    /* the current is at its limit */
    bool index_seen;  /* since the search has begun */
    uint32_t index;   /* and where: the counter then */
};

/* Begins here. The caller forgets index pulses that came before. Slow loop, or while it is masked. */
void homing_begin(struct homing *h, enum homing_method method, const struct turns *turns);

/* One step a millisecond. Slow loop. */
enum homing_result homing_step(struct homing *h, const struct homing_view *v);

#endif

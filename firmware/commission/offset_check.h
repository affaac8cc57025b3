/* SPDX-License-Identifier: MIT */
/*
 * Whether an offset that was remembered, from an earlier `on` or by the index, is the rotor's: before anything turns.
 *
 * A rotor at rest is pushed by a current that rises slowly until the encoder has moved by a few counts, and is taken back.
 * Along the supposed d axis nothing moves if the offset is right. What moves shows by its sense on which side the magnets are,
 * and pushes in directions that halve the angle between find how far. A current across the axis must turn it forward, or the
 * offset is half a turn off; it goes to a second place, where the axis is looked at again: exchanged phases, or tracks of the
 * encoder, mirror the angle, and a mirror is right at two places of a turn.
 * Only the sense of the first motion counts, so neither inertia nor friction nor a load that is at rest needs to be known.
 *
 * A rotor that turns shows it by its EMF instead, without current.
 */
#ifndef FIRMWARE_COMMISSION_OFFSET_CHECK_H
#define FIRMWARE_COMMISSION_OFFSET_CHECK_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/current_loop.h"
#include "firmware/control/emf.h"
#include "firmware/settings/tuning.h"

enum offset_result {
    OFFSET_RUNNING,
    OFFSET_RIGHT,
    OFFSET_UNKNOWN, /* nothing moved either way, or it turns too slowly to tell */
    OFFSET_WRONG,   /* by off_deg */
};

struct offset_check {
    bool turns;     /* from the beginning: by EMF */
    bool holds;     /* the push is over */
    bool fades;     /* the holding current, before a look at the second place */
    bool elsewhere; /* at the second place */
    bool again;     /* there by the opposite current: what moves as before creeps by itself */
    uint32_t step, ms;
    uint32_t latched;    /* counter at the last step */
    int32_t counts;      /* since the beginning, */
    int32_t from;        /* as the push began, */
    int32_t moves;       /* and how many are a motion */
    int32_t still_ms;    /* since the last one */
    int32_t speed_q16;   /* counts a millisecond */
    int32_t i_max_q15;   /* of a push, */
    int32_t rise_ms;     /* in which it gets there */
    int32_t i_q15;       /* now, */
    uint32_t along_q32;  /* and its direction, from the supposed d axis */
    int32_t sense;       /* of what moved: 1, -1; 0: nothing */
    int32_t caught;      /* how often it was held by another direction than the push's */
    int32_t hold_sense;  /* of a motion by what holds it */
    int32_t side;        /* of the axis on which the magnets seemed to be at the first place; 0: neither */
    int32_t i_moves_q15; /* the one that has moved it */
    int32_t speed_ms, damping_ms, rest_ms;
    int32_t second, second_ms; /* counts to the second place, and the time for them */
    int32_t low_q4, high_q4;   /* degrees between which the magnets are, from where they should be, */
    int32_t middle_q4;         /* and where they are being looked for */
    int32_t off_deg;
    struct emf emf;
};

/*
 * True if a push does not tell: counts are too far apart, or reluctance outweighs the magnets, whose torque neither changes its
 * sign with the current nor vanishes just along the axis. Only a rotor that turns shows it then. Any context.
 */
bool offset_check_is_blind(const struct tuning *t);

/* `turns`: the shaft has moved by itself. Slow loop, bridge off. */
void offset_check_start(struct offset_check *o, const struct tuning *t, uint32_t latched, bool turns);

/* One step a millisecond; sets the current references in the encoder's frame. Slow loop, bridge on. */
enum offset_result offset_check_step(struct offset_check *o, volatile struct current_loop *c, const struct tuning *t,
                                     uint32_t latched);

#endif

/* SPDX-License-Identifier: MIT */
/*
 * Verifies a remembered offset, from an earlier `on` or by the index, before anything turns.
 *
 * A rotor at rest is pushed by a slowly rising current until the encoder has moved by a few counts, and is moved back. Along
 * the assumed d axis nothing moves if the offset is right. The direction of a motion shows on which side the magnets are;
 * bisection of the current's direction finds their angle. A q current must turn it forward, otherwise the offset is wrong by
 * half a turn; it moves to a second position, where the axis is tested again: exchanged phases, or exchanged encoder tracks,
 * mirror the angle, and a mirrored angle is right at two positions of a turn. Only the direction of the first motion is used,
 * so inertia, friction and a static load need not be known.
 *
 * With a turning rotor the EMF is used instead, without current.
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
    OFFSET_UNKNOWN, /* no motion in either direction, or it turns too slowly */
    OFFSET_WRONG,   /* by off_deg */
};

struct offset_check {
    bool turns;     /* the rotor turned at the beginning: by EMF */
    bool holds;     /* the push is over */
    bool fades;     /* ramping down the holding current, before the test at the second position */
    bool elsewhere; /* at the second position */
    bool again;     /* repeated there with opposite current: the same motion is then caused by something else */
    uint32_t step, ms;
    uint32_t latched;    /* counter at the last step */
    int32_t counts;      /* since the beginning */
    int32_t from;        /* as the push began */
    int32_t moves;       /* counts that are a motion */
    int32_t still_ms;    /* since the last one */
    int32_t speed_q16;   /* counts a millisecond */
    int32_t i_max_q15;   /* maximum of a push */
    int32_t rise_ms;     /* its rise time */
    int32_t i_q15;       /* present value */
    uint32_t along_q32;  /* its direction, from the assumed d axis */
    int32_t sense;       /* direction of the motion: 1, -1; 0: none */
    int32_t caught;      /* how often it was held with a direction other than the push's */
    int32_t hold_sense;  /* direction of a motion by the holding current */
    int32_t side;        /* side of the axis on which the magnets seemed to be at the first position; 0: neither */
    int32_t i_moves_q15; /* current that has moved it */
    int32_t speed_ms, damping_ms, rest_ms;
    int32_t second, second_ms; /* counts to the second position, and the time for them */
    int32_t low_q4, high_q4;   /* degrees between which the magnets are, relative to the assumed axis */
    int32_t middle_q4;         /* where they are tested */
    int32_t off_deg;
    struct emf emf;
};

/*
 * True if pushes are inconclusive: too few counts, or reluctance outweighs the magnets: its torque neither changes its sign
 * with the current nor vanishes only along the axis. Then only a turning rotor can be tested. Any context.
 */
bool offset_check_is_blind(const struct tuning *t);

/* `turns`: the shaft is turning. Slow loop, bridge off. */
void offset_check_start(struct offset_check *o, const struct tuning *t, uint32_t latched, bool turns);

/* One step a millisecond; sets the current references in the encoder's frame. Slow loop, bridge on. */
enum offset_result offset_check_step(struct offset_check *o, volatile struct current_loop *c, const struct tuning *t,
                                     uint32_t latched);

#endif

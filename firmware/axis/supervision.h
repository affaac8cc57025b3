/* SPDX-License-Identifier: MIT */
/*
 * What is watched while the motor runs, once a millisecond, after everything else of the slow loop. Each part reports a fault;
 * what follows is axis/reaction.h's. The order is that in which one fault could pass for another: encoder, phases, then what
 * the speed and current loops make of them.
 */
#ifndef FIRMWARE_AXIS_SUPERVISION_H
#define FIRMWARE_AXIS_SUPERVISION_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/axis/carry.h"
#include "firmware/axis/fault.h"
#include "firmware/control/emf.h"

struct axis;

#define SUPERVISION_TURNS      4u /* milliseconds in which each part has had its turn */
#define SUPERVISION_EMF_TURN   1u /* the EMF is worked out, */
#define SUPERVISION_JUDGE_TURN 3u /* and judged */
#define SUPERVISION_STILL_MS   4u /* without a count: the encoder may be dead */

/*
 * The encoder, against itself and against the back-EMF. A shaft does not jump: where the count is far from where the speed of a
 * millisecond ago would have brought it, the encoder is in doubt until the EMF has told, and no other fault that hangs on the
 * angle is believed. Where the EMF is too small to tell, the jump alone decides.
 */
struct encoder_watch {
    struct emf emf;
    int32_t speed_q32;            /* the observer's at the last step */
    int32_t speed_before_q32;     /* and a step before */
    uint32_t doubt_ms;            /* how much longer the encoder is in doubt */
    int32_t jump_q32;             /* by which it got there, electrical */
    int32_t w_before_q15;         /* speed before the jump */
    struct rotor_seed sound;      /* the rotor as the speed before the jump would have it */
    int32_t torque_q29;           /* and what the speed loop remembered of the torque */
    struct emf_vector emf_before; /* and the EMF then */
    uint32_t against_ms;          /* since when the EMF says something else */
    uint32_t still_ms;            /* since when no count has come */
    int32_t speed_moving_q32;     /* the observer's speed before that */
    int32_t dead_w_q15;           /* from this speed no shaft stands still at once */
    uint32_t still_limit_q15;     /* speed times milliseconds that make some counts */
    int32_t jump_limit_q32;
    /* index pulses: where the count was, for each direction */
    int32_t index_first[2], index_last[2];
    bool index_known[2];
    int32_t index_drift; /* at the last pulse, since the first */
    uint32_t index;      /* as last read */
};

/* Phases: what references and angle have asked of each while it carried nothing. */
struct phase_watch {
    int32_t missing_q15[3];           /* sums, a summand every second millisecond */
    int32_t i_d_ref_q15, i_q_ref_q15; /* of the millisecond before: what the currents have followed since */
    int32_t least_q15;                /* that can be told from nothing */
    int32_t carried_q15;              /* by all of them, in the last few looks */
};

struct speed_watch {
    int32_t deviation_q4; /* of rpm: what is too far */
    uint32_t far_ms;
    int32_t distance_q4; /* from the reference, at the last step */
    int32_t rate_q4;     /* its growth a millisecond, smoothed */
    uint32_t losing_ms;  /* since when it will soon be too far, with all the current there is */
    uint32_t stalled_ms;
    uint32_t limited_ms; /* since when the voltage is limited and the current is not what it should be */
};

/* A limit cycle: half waves of the speed error, near equally long, with much current. */
struct cycle_watch {
    bool error_below;
    uint32_t softened;         /* how often the gains have been reduced */
    uint32_t half_ms;          /* of the half wave that runs */
    uint32_t last_half_ms;     /* of the one before */
    uint32_t halves;           /* how many in a row were alike */
    int32_t low_q15, high_q15; /* extremes of the current in this half wave and the last */
    int32_t last_low_q15, last_high_q15;
};

struct supervision {
    struct encoder_watch encoder;
    struct phase_watch phases;
    struct speed_watch speed;
    struct cycle_watch cycle;
};

/* Begins with what the parameters say. Slow loop, when operation begins. */
void supervision_begin(struct axis *a);

/*
 * The cause of an over-current: the encoder's, if it has just lost the angle, else what it looks like. From the current loop's
 * interrupt, when a sample has a fault.
 */
enum fault supervise_encoder_blame(const struct axis *a, enum fault seen);

/*
 * Where the rotor is for all that is known of an encoder with this fault: by the frame if its counts were good until now, by
 * the last good angle and speed, or by the EMF. Interrupts masked; the other, of a sample, in the current loop's interrupt.
 */
void supervise_encoder_seed(const struct axis *a, enum fault cause, struct rotor_seed *seed);
void supervise_encoder_seed_at_sample(const struct axis *a, enum fault cause, struct rotor_seed *seed);

/* What the speed loop remembered of the torque before the encoder was in doubt, Q15 with 14 more bits. Slow loop. */
int32_t supervise_encoder_torque_q29(const struct axis *a);

/* No encoder any more: nothing of it is in doubt, and the speed loop remembers what it did before it was. Slow loop. */
void supervise_encoder_forget(struct axis *a);

/*
 * Whether a phase has begun to carry nothing, and which (as in the fault's detail): too short a time for a fault of its own,
 * long enough to be the cause of an over-current or of a speed that is lost. Any context.
 */
bool supervise_phases_suspect(const struct axis *a, int32_t *phase);

/* No count has come where some were due: in a few milliseconds it will be known, and the speed says nothing until then. */
bool supervise_encoder_may_be_dead(const struct axis *a);

/* One step: supervision_step.h. Slow loop, last. */
void supervision_step(struct axis *a);

/* How far a shaft that moved by so many counts in so many clocks is from where its speed would have brought it, electrical. */
static inline int32_t supervise_encoder_surprise_q32(const struct tuning *t, int32_t moved, uint32_t clocks,
                                                     int32_t speed_q32)
{
    const uint32_t loop_counts = (uint32_t)t->loop_counts;
    const uint32_t samples = (clocks + loop_counts / 2u) / loop_counts;
    return (int32_t)((uint32_t)moved * t->encoder_scale_q32 - samples * (uint32_t)speed_q32);
}

/* The parts. */
void supervise_encoder_begin(struct axis *a);
void supervise_encoder(struct axis *a, int32_t surprise_q32,
                       uint32_t turn);         /* at its turns, and where something is strange */
void supervise_encoder_by_emf(struct axis *a); /* its last turn, while nothing is strange and the EMF is clear */
void supervise_index(struct axis *a);          /* in that turn, after a pulse */
void supervise_phases_begin(struct axis *a);
void supervise_phases(struct axis *a); /* every second millisecond */
void supervise_speed_begin(struct axis *a);
void supervise_speed(struct axis *a); /* every second */
void supervise_short_voltage(
    struct axis *a); /* every SUPERVISION_TURNS these three, where they have to say something */
void supervise_temperature(struct axis *a);
void supervise_commands(struct axis *a);

#endif

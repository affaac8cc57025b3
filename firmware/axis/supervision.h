/* SPDX-License-Identifier: MIT */
/*
 * Supervision while the motor runs, once a millisecond, last in the slow loop. Each part reports a fault; axis/reaction.h
 * decides what follows. The order is that in which one fault could pass for another: encoder, phases, then their effects on the
 * speed and current loops.
 */
#ifndef FIRMWARE_AXIS_SUPERVISION_H
#define FIRMWARE_AXIS_SUPERVISION_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/axis/carry.h"
#include "firmware/axis/fault.h"
#include "firmware/control/emf.h"

struct axis;

#define SUPERVISION_TURNS      4u /* milliseconds until each part has had its turn */
#define SUPERVISION_EMF_TURN   1u /* the EMF is computed, */
#define SUPERVISION_JUDGE_TURN 3u /* and judged */
#define SUPERVISION_STILL_MS   4u /* without a count: the encoder may be dead */

/*
 * Checks the encoder against itself and against the back-EMF. A shaft does not jump: if the count is far from what the speed of
 * a millisecond ago predicts, the encoder is in doubt until the EMF decides, and no other fault that depends on the angle is
 * believed. If the EMF is too small to decide, the jump alone does.
 */
struct encoder_watch {
    struct emf emf;
    int32_t speed_q32;            /* the observer's at the last step */
    int32_t speed_before_q32;     /* and one step earlier */
    uint32_t doubt_ms;            /* how much longer the encoder is in doubt */
    int32_t jump_q32;             /* the jump that put it in doubt, electrical */
    int32_t w_before_q15;         /* speed before the jump */
    struct rotor_seed sound;      /* the rotor as predicted by the speed before the jump */
    int32_t torque_q29;           /* the speed loop's torque memory then */
    struct emf_vector emf_before; /* and the EMF then */
    uint32_t against_ms;          /* how long the EMF has contradicted it */
    uint32_t still_ms;            /* time without a count */
    int32_t speed_moving_q32;     /* the observer's speed before that */
    int32_t dead_w_q15;           /* from this speed no shaft stops at once */
    uint32_t still_limit_q15;     /* speed times milliseconds that must give some counts */
    uint32_t jump_limit_q32;
    /* index pulses: the count at each, per direction */
    int32_t index_first[2], index_last[2];
    bool index_known[2];
    int32_t index_drift; /* at the last pulse, since the first */
    uint32_t index;      /* as last read */
};

/* Phases: what references and angle asked of each while it carried no current. */
struct phase_watch {
    int32_t missing_q15[3];           /* sums, one term every second millisecond */
    int32_t i_d_ref_q15, i_q_ref_q15; /* of the previous millisecond: what the currents have followed since */
    int32_t least_q15;                /* smallest that can be told from zero */
    int32_t carried_q15;              /* by all phases, in the last few looks */
};

struct speed_watch {
    int32_t deviation_q4; /* rpm: the limit */
    uint32_t far_ms;
    int32_t distance_q4; /* from the reference, at the last step */
    int32_t rate_q4;     /* its growth per millisecond, smoothed */
    uint32_t losing_ms;  /* how long it has been about to exceed the limit, at full current */
    uint32_t stalled_ms;
    uint32_t limited_ms; /* how long the voltage has been limited and the current off its reference */
};

/* A limit cycle: half waves of the speed error, nearly equal in length, with much current. */
struct cycle_watch {
    bool error_below;
    uint32_t softened;         /* how often the gains have been reduced */
    uint32_t half_ms;          /* of the present half wave */
    uint32_t last_half_ms;     /* of the one before */
    uint32_t halves;           /* similar ones in a row */
    int32_t low_q15, high_q15; /* extremes of the current in this half wave and the last */
    int32_t last_low_q15, last_high_q15;
};

struct supervision {
    struct encoder_watch encoder;
    struct phase_watch phases;
    struct speed_watch speed;
    struct cycle_watch cycle;
};

/* Starts, from the parameters. Slow loop, when operation begins. */
void supervision_begin(struct axis *a);

/*
 * The cause of an over-current: the encoder, if it has just lost the angle, else what it looks like. Called from the current
 * loop's interrupt when a sample has a fault.
 */
enum fault supervise_encoder_blame(const struct axis *a, enum fault seen);

/*
 * The best estimate of the rotor when the encoder has this fault: from the frame if its counts were good until now, from the
 * last good angle and speed, or from the EMF. Interrupts masked; the other, for a sample, in the current loop's interrupt.
 */
void supervise_encoder_seed(const struct axis *a, enum fault cause, struct rotor_seed *seed);
void supervise_encoder_seed_at_sample(const struct axis *a, enum fault cause, struct rotor_seed *seed);

/* The speed loop's torque memory from before the encoder was in doubt, Q15 with 14 more bits. Slow loop. */
int32_t supervise_encoder_torque_q29(const struct axis *a);

/* The encoder is out of use: clears its doubt, and restores the speed loop's torque memory from before. Slow loop. */
void supervise_encoder_forget(struct axis *a);

/*
 * True if a phase has begun to carry nothing, and which (as in the fault's detail): too briefly for a fault of its own, long
 * enough to be the cause of an over-current or a lost speed. Any context.
 */
bool supervise_phases_suspect(const struct axis *a, int32_t *phase);

/* True if counts were due but none came: a few milliseconds will decide, and the speed is unreliable until then. */
bool supervise_encoder_may_be_dead(const struct axis *a);

/* One step: supervision_step.h. Slow loop, last. */
void supervision_step(struct axis *a);

/* How far a shaft that moved by these counts in these clocks is from where its speed predicts, electrical. */
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
                       uint32_t turn);         /* in its turns, and when something is strange */
void supervise_encoder_by_emf(struct axis *a); /* in its last turn, if nothing is strange and the EMF is clear */
void supervise_index(struct axis *a);          /* in that turn, after a pulse */
void supervise_phases_begin(struct axis *a);
void supervise_phases(struct axis *a); /* every second millisecond */
void supervise_speed_begin(struct axis *a);
void supervise_speed(struct axis *a);         /* likewise */
void supervise_short_voltage(struct axis *a); /* these three every SUPERVISION_TURNS, if they apply */
void supervise_temperature(struct axis *a);
void supervise_commands(struct axis *a);

#endif

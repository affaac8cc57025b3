/* SPDX-License-Identifier: MIT */
/*
 * Checks the encoder against itself and against the back-EMF. A shaft does not jump: if the count is far from what the speed of
 * a millisecond ago predicts, the encoder is in doubt until the EMF decides, and no other fault that depends on the angle is
 * believed. If the EMF is too small to decide, the jump alone does. A shaft that rings on its coupling surprises more and more,
 * and lost counts at once: twice what was usual in the last milliseconds is no jump.
 */
#ifndef FIRMWARE_MONITOR_ENCODER_WATCH_H
#define FIRMWARE_MONITOR_ENCODER_WATCH_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/emf.h"
#include "firmware/fault/fault.h"
#include "firmware/monitor/slip_watch.h"
#include "firmware/source/rotor_seed.h"

struct encoder_watch {
    struct emf emf;
    struct slip_watch slip;
    int32_t speed_q32;            /* the observer's at the last step */
    int32_t speed_before_q32;     /* and one step earlier */
    uint32_t doubt_ms;            /* how much longer the encoder is in doubt */
    int32_t jump_q32;             /* the jump that put it in doubt, electrical */
    int32_t w_before_q15;         /* speed before the jump */
    struct rotor_seed sound;      /* the rotor as predicted by the speed before the jump */
    int32_t torque_q29;           /* the speed loop's torque memory then */
    struct emf_vector emf_before; /* and the EMF then */
    uint32_t against_ms;          /* how long the EMF has contradicted it */
    uint32_t agreed;              /* how often it has agreed since operation began; AGREED_OFTEN at most */
    uint32_t still_ms;            /* time without a count, */
    uint32_t looked_ms;           /* the part of it in which the EMF was looked at, */
    uint32_t turning_ms;          /* and how long it has shown a rotor that turns nevertheless */
    bool stopped;                 /* it has shown none: the shaft was stopped within milliseconds */
    int32_t speed_moving_q32;     /* the observer's speed before that */
    int32_t dead_w_q15;           /* from this speed no shaft stops at once */
    uint32_t still_limit_q15;     /* speed times milliseconds that must give some counts */
    uint32_t jump_least_q32, jump_limit_q32;
    uint32_t usual_q32; /* the largest surprise of late: of a shaft that rings on its coupling */
    /* index pulses: the count at each, per direction */
    int32_t index_first[2], index_last[2];
    bool index_known[2];
    int32_t index_drift; /* at the last pulse, since the first */
    bool index_slip;     /* and whether that is a slip */
    uint32_t index;      /* as last read */
};

/* Starts, from the parameters. Slow loop, when operation begins. */
void encoder_watch_begin(struct axis *a);

/*
 * One millisecond of operation with an encoder; `turn` counts from 0 to 3. Returns false while it is in doubt, or has just
 * failed: the measured speed is the encoder's, and no other fault that depends on it is believed. Slow loop.
 */
bool encoder_watch_step(struct axis *a, uint32_t turn);

/* The cause of an over-current: the encoder, if it has just lost the angle, else what it looks like. ISR, cold. */
enum fault encoder_watch_blame(const struct axis *a, enum fault seen);

/* True if the shaft was stopped, as by an end stop, and rests since. */
static inline bool encoder_watch_has_stopped(const struct encoder_watch *e)
{
    return e->stopped;
}

/* True if the offset was found by this start, or the EMF has shown it since. Any context. */
bool encoder_watch_offset_is_sure(const struct axis *a);

/* True if counts were due but none came: a few milliseconds will decide, and the speed is unreliable until then. */
bool encoder_watch_may_be_dead(const struct axis *a);

/*
 * The best estimate of the rotor when the encoder has this fault: from the frame if its counts were good until now, from the
 * last good angle and speed, or from the EMF. Interrupts masked; the other, for a sample, in the current loop's interrupt.
 */
void encoder_watch_seed(const struct axis *a, enum fault cause, struct rotor_seed *seed);
void encoder_watch_seed_at_sample(const struct axis *a, enum fault cause, struct rotor_seed *seed);

/* The rotor, if this count is `jump_q32` away from it. */
struct rotor_seed encoder_watch_seed_of(const struct axis *a, uint32_t count, int32_t jump_q32, uint32_t clock);

/* How far the present count is from where the slow loop's last look predicts. */
int32_t encoder_watch_surprise_q32(const struct axis *a);

/* The speed loop's torque memory from before the encoder was in doubt, Q15 with 14 more bits. Slow loop. */
int32_t encoder_watch_torque_q29(const struct axis *a);

/* The encoder is out of use: clears its doubt, and restores the speed loop's torque memory from before. Slow loop. */
void encoder_watch_forget(struct axis *a);

#endif

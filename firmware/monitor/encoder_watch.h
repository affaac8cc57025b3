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

#include "firmware/control/current_loop.h"
#include "firmware/control/emf.h"
#include "firmware/fault/fault.h"

/* ==== lost counts, by the EMF ==== */

/*
 * Counts lost one by one, seen by what the back-EMF becomes. How far it may be off the q axis from the beginning is as much
 * as dead time, resistance and Lq are unknown (control/emf.h), and Lq is learnt, which under load hides a slip. But at one
 * speed and current all of that stays as it is: so the EMF across the rotor is remembered, at the Lq known then, and what
 * it has changed by is the slip's. Another speed or current, asked for, begins anew.
 *
 * Voltages Q15 of v_range, currents Q15 of i_range, speed as current_loop_w_q15(). Context: slow loop, each second millisecond.
 */

/* What is remembered. All zero: nothing yet. */
struct slip_watch {
    int32_t i_d_q15, i_q_q15, w_q15; /* the currents asked for and the speed, */
    int32_t lq_q19;                  /* the Lq that was known then, */
    int32_t across_q15;              /* and the EMF's d component; until enough steps were seen, their sum */
    int32_t changed_q15;             /* by how much it has changed since, filtered as the EMF is */
    int32_t elsewhere;               /* steps in a row at another speed or current */
    int32_t steps;                   /* seen of what is remembered */
    int32_t against;                 /* steps in which that was too much */
};

/*
 * One step with the present voltages; `e` is that of the last milliseconds. True if the rotor has turned away by about 11
 * degrees, and what a change of speed and current may explain, for three steps.
 */
bool slip_watch_step(struct slip_watch *s, const struct emf *e, const volatile struct current_loop *c,
                     const struct tuning *t);

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

/* SPDX-License-Identifier: MIT */
/*
 * Checks the encoder against itself and against the back-EMF. If the count deviates much from what the speed of a millisecond
 * ago predicts (a jump), the encoder is suspect until the EMF decides, and no other fault that depends on the angle is
 * reported. If the EMF is too small to decide, the jump alone does. Deviations of a shaft that oscillates on its coupling grow
 * gradually, lost counts appear suddenly: up to twice the usual deviation of the last milliseconds is no jump.
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
 * Gradual loss of counts, found by a change of the back-EMF. The EMF's initial deviation from the q axis depends on dead time,
 * resistance and Lq (control/emf.h), and learning Lq can hide a slip under load. But at constant speed and current these errors
 * are constant: the d component of the EMF is stored, with the Lq of then, and its change is due to slip. Another reference
 * speed or current starts over.
 *
 * Voltages Q15 of v_range, currents Q15 of i_range, speed as current_loop_w_q15(). Context: slow loop, each second millisecond.
 */

/* The stored operating point. All zero: none yet. */
struct slip_watch {
    int32_t i_d_q15, i_q_q15, w_q15; /* references of the currents, and speed */
    int32_t lq_q19;                  /* Lq at that time */
    int32_t across_q15;              /* the EMF's d component; their sum until there are enough steps */
    int32_t changed_q15;             /* its change since, filtered like the EMF */
    int32_t elsewhere;               /* steps in a row at another speed or current */
    int32_t steps;                   /* that were averaged */
    int32_t against;                 /* steps with too large a change */
};

struct encoder_watch {
    struct emf emf;
    struct slip_watch slip;
    int32_t speed_q32;            /* the observer's at the last step */
    int32_t speed_before_q32;     /* and one step earlier */
    uint32_t suspect_ms;          /* how much longer the encoder is suspect */
    int32_t jump_q32;             /* the jump that made it suspect, electrical */
    int32_t w_before_q15;         /* speed before the jump */
    struct rotor_seed sound;      /* the rotor as predicted by the speed before the jump */
    int32_t torque_q29;           /* the speed loop's integral then */
    struct emf_vector emf_before; /* and the EMF then */
    uint32_t against_ms;          /* how long the EMF has contradicted it */
    uint32_t agreed;              /* how often it has agreed since operation began; AGREED_OFTEN at most */
    uint32_t still_ms;            /* time without a count */
    uint32_t looked_ms;           /* part of it in which the EMF was evaluated */
    uint32_t turning_ms;          /* part of it in which the EMF showed a turning rotor */
    bool stopped;                 /* no EMF: the shaft was stopped within milliseconds */
    int32_t speed_moving_q32;     /* the observer's speed before that */
    int32_t dead_w_q15;           /* above this speed a shaft cannot stop within a millisecond */
    uint32_t still_limit_q15;     /* speed times milliseconds that must give some counts */
    uint32_t jump_min_q32, jump_limit_q32;
    uint32_t usual_q32; /* usual deviation: maximum of the last milliseconds, decaying */
    /* index pulses: the count at each, per direction */
    int32_t index_first[2], index_last[2];
    bool index_known[2];
    int32_t index_drift; /* at the last pulse, since the first */
    bool index_slip;     /* true if that is a slip */
    uint32_t index;      /* as last read */
};

/* Starts, from the parameters. Slow loop, when operation begins. */
void encoder_watch_begin(struct axis *a);

/*
 * One millisecond of operation with an encoder; `turn` counts from 0 to 3. Returns false while it is suspect, or has just
 * failed: then no fault that depends on the measured speed is reported. Slow loop.
 */
bool encoder_watch_step(struct axis *a, uint32_t turn);

/* The cause of an over-current: the encoder, if it has just lost the angle, else the given one. ISR, cold. */
enum fault encoder_watch_blame(const struct axis *a, enum fault seen);

/* True if the shaft was stopped, as by an end stop, and rests since. */
static inline bool encoder_watch_has_stopped(const struct encoder_watch *e)
{
    return e->stopped;
}

/* True if the offset was found by this start, or verified by the EMF since. Any context. */
bool encoder_watch_offset_is_verified(const struct axis *a);

/* True if counts were due but none came: a few milliseconds will decide, and the speed is unreliable until then. */
bool encoder_watch_may_be_dead(const struct axis *a);

/*
 * The best estimate of the rotor when the encoder has this fault: from the frame if its counts were good until now, from the
 * last good angle and speed, or from the EMF. Interrupts masked; the other, for a sample, in the current loop's interrupt.
 */
void encoder_watch_seed(const struct axis *a, enum fault cause, struct rotor_seed *seed);
void encoder_watch_seed_at_sample(const struct axis *a, enum fault cause, struct rotor_seed *seed);

/* The rotor's angle if this count is wrong by `jump_q32`. */
struct rotor_seed encoder_watch_seed_of(const struct axis *a, uint32_t count, int32_t jump_q32, uint32_t clock);

/* The present count's deviation from what the slow loop's last step predicts. */
int32_t encoder_watch_deviation_q32(const struct axis *a);

/* The speed loop's integral from before the encoder became suspect, Q15 with 14 more bits. Slow loop. */
int32_t encoder_watch_torque_q29(const struct axis *a);

/* The encoder is no longer used: clears the suspicion, and restores the speed loop's integral from before. Slow loop. */
void encoder_watch_forget(struct axis *a);

#endif

/* SPDX-License-Identifier: MIT */
/*
 * The speed loop: ramp, PI with feed-forward of the acceleration, limits. Once a millisecond, in the slow loop.
 */
#ifndef FIRMWARE_CONTROL_SPEED_LOOP_H
#define FIRMWARE_CONTROL_SPEED_LOOP_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/current_loop.h"
#include "firmware/control/interval.h"
#include "firmware/control/notch.h"
#include "firmware/control/oscillation.h"
#include "firmware/control/speed_estimate.h"
#include "firmware/settings/tuning.h"

struct speed_loop {
    struct speed_estimate estimate;
    int32_t speed_rpm_q4;     /* measured */
    int32_t speed_ref_rpm_q4; /* after the ramp */
    int32_t target_rpm_q16;   /* before it: the command */
    int32_t ref_rpm_q16;
    int32_t integral_q29; /* torque in Q15, 14 more bits of fraction */
    bool at_limit;        /* the torque demand is limited */
    bool torque_is_slow;  /* voltage limits its slew: a quarter of the bandwidth then; set by the caller */
    int32_t kp_q16;       /* the tuning's gains, less what an oscillation has taken */
    int32_t ki_q16;
    int32_t accel_share_q15;                 /* of the feed-forward; 32768 but for a shaft that is light */
    int32_t error_max_q15;                   /* beyond it the output is twice the range anyway */
    int32_t moved_q16;                       /* the reference's last step that was one */
    int32_t course_rpm_q15, course_step_q15; /* where the ramp goes, without its waits */
    bool estimated;                          /* the speed: not by an encoder */
    int32_t swing;                           /* +1 or -1: which way an estimate's next one goes */
    uint32_t swing_ms, swings, reductions;
    int32_t demand_q15; /* of the last step, within its limits */
    struct oscillation oscillation;
    struct notch notch;                                /* where the coupling rings */
    int32_t before_q15[PARAM_TORQUE_MEAN_MOST_MS - 1]; /* torque demands of the last steps, latest first */
};

/* Measures the speed. Every slow period, in any state. */
void speed_loop_measure(struct speed_loop *s, const struct encoder_regs *encoder, const struct tuning *t);

/*
 * The same for a speed from another source, measured over `clocks` fabric clocks: the longer, the smaller the gains.
 * `travel_q15` is the shaft's travel in this millisecond, as a speed.
 */
void speed_loop_take(struct speed_loop *s, int32_t speed_rpm_q15, int32_t travel_q15, uint32_t clocks);

/* Moves the reference towards the command in open loop: the shaft follows by itself. Returns rpm Q16. */
int32_t speed_loop_lead(struct speed_loop *s, int32_t slope_q16);

/* The state before the first use. Thread, once. */
void speed_loop_init(struct speed_loop *s);

/* Takes all gains: at every switch-on. Thread, slow loop masked. */
void speed_loop_tune(struct speed_loop *s, const struct tuning *t);

/* Whether it reduces its gains where it oscillates: yes, from each switch-on. Slow loop. */
void speed_loop_allow_less(struct speed_loop *s, bool allowed);

/* Sets smaller gains, not 0, while it runs. */
void speed_loop_soften(struct speed_loop *s, int32_t kp_q16, int32_t ki_q16);

/* Starts from the present speed and torque, without a step. */
void speed_loop_reset(struct speed_loop *s, int32_t torque_q15);

/*
 * The integral before its last step, whose speed proved wrong; `answered_backwards`: that step's torque was not positive. Rare.
 */
int32_t speed_loop_before_q29(const struct speed_loop *s, bool answered_backwards);

/*
 * One step: returns the torque demand (torque.h). The limits do not clamp it, they stop the integral. `slope_q16` is the ramp
 * in rpm Q16 per millisecond.
 */
int32_t speed_loop_step(struct speed_loop *s, const struct tuning *t, int32_t slope_q16, const struct interval *limits);

#define SPEED_LOOP_FULL_GAIN_CLOCKS 150000u /* 1.5 ms: while an edge comes in nearly every step */

/*
 * The share of the gains for the time between edges, Q14: a loop must not respond faster than it measures. The proportional
 * part takes it once, the integral twice: the whole loop gets slower and keeps its damping.
 */
static inline int32_t speed_loop_share_q14(const struct speed_estimate *e)
{
    const uint32_t clocks = e->interval_clocks;
    return clocks > SPEED_LOOP_FULL_GAIN_CLOCKS ? (int32_t)((SPEED_LOOP_FULL_GAIN_CLOCKS << 14) / clocks) : 1 << 14;
}

/*
 * The same if the caller moves the reference: to `ref_rpm_q16` in this step, and by `moved_q16` in the next one, for the
 * feed-forward.
 */
int32_t speed_loop_follow(struct speed_loop *s, const struct tuning *t, int32_t ref_rpm_q16, int32_t moved_q16,
                          const struct interval *limits);

#endif

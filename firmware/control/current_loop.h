/* SPDX-License-Identifier: MIT */
/*
 * The current loop: the end-of-conversion interrupt, once or twice a PWM period, at the highest priority.
 *
 * current_loop_step.h does the interrupt's work in C, with one instance for each angle source; the one for the encoder also
 * exists in assembly (current_loop_isr.S), which is faster. The vector selects the instance: current_loop_select(). The slow
 * loop prepares its inputs once a millisecond: gains for the present bus voltage, feed-forward, thresholds (in the ADC block).
 * Its state can be watched in the structure while the motor turns.
 *
 * The interrupt preempts everything else, so lower-priority code takes the structure as volatile: each access then happens
 * once, in the order written.
 *
 * Inside the loop, voltages are in steps of 2^-CONFIG_V_SHIFT counts of half the on-time. So the gains contain the bus voltage,
 * and the voltage limit is a constant.
 */
#ifndef FIRMWARE_CONTROL_CURRENT_LOOP_H
#define FIRMWARE_CONTROL_CURRENT_LOOP_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/cortex/cpu.h"
#include "drivers/fabric/fabric.h"
#include "firmware/control/current_loop_layout.h"
#include "firmware/control/injection.h"
#include "firmware/control/observer.h"
#include "firmware/settings/tuning.h"
#include "lib/pll.h"
#include "lib/q15.h"

#define LOOP_V_D_MAX_STEPS (1 << (LOOP_V_D_BITS - 1))

/*
 * The largest turn, at 0.62 CONFIG_SPEED_BASE_HZ for 1.5 periods, at 0.41 if the circle is large; beyond it the voltages lag. A
 * larger turn could rotate a saturated voltage back inside the circle and hide the limit from the integral: make prove.
 */
#define LOOP_TURN_MAX_Q15 (CONFIG_RADIUS_STEPS > 23200 ? 8000 : 11900)

/* Where the field's angle comes from. */
enum loop_source {
    LOOP_ENCODER,   /* the rotor's, from the encoder */
    LOOP_FORCED,    /* current_loop_field(), regardless of the rotor */
    LOOP_OBSERVER,  /* the rotor's from the flux observer, or prescribed while the observer finds it: field_follows */
    LOOP_INJECTION, /* the same from the saliency, with a voltage added */
    LOOP_HALL,      /* the same from Hall switches: hall.h */
    LOOP_SOURCES,
};

/* An axis's instances of the interrupt, and the vector that chooses one of them. */
struct loop_handlers {
    void (**vector)(void);
    void (*handler[LOOP_SOURCES])(void);
    void (*weakening)(void);      /* replaces [LOOP_ENCODER] in field weakening */
    void (*overmodulating)(void); /* replaces weakening beyond the modulator's circle */
    void (*rippled)(void);        /* replaces [LOOP_ENCODER], whose dead_shift is 0 */
};

/* Extra state of the field-weakening instances (stage_weaken.h). */
struct loop_weakening {
    bool on;                    /* from the tuning: these instances are used */
    uint32_t turn_q32;          /* how far the frame turns until the voltages act: turn_q15 without its limit */
    int32_t radius_steps;       /* of the voltage circle: the modulator's, or overmodulation's */
    int32_t q_first;            /* which axis gets the circle first, the other the rest: all ones q, 0 d */
    int32_t first_max_steps;    /* its maximum */
    int32_t gain_q15;           /* retreat, LSB of current per step that v_q lacks; has w's sign */
    int32_t gain_share_q8;      /* of the current loops' gains; 256 within the modulator's circle */
    int32_t max_q15;            /* largest retreat */
    int32_t room_q_steps;       /* v_q left by a steady d, plus a step of its reference: below it no retreat */
    int32_t kick_steps;         /* part of room_q_steps: the controller's response to q reference steps */
    int32_t i_q_ref_before_q15; /* of the last millisecond */
    int32_t retreat_q22;        /* reduction of i_d below its reference, Q15 with 7 more bits */
};

struct current_loop {
    struct pll pll;            /* angle predicted for the next sample, and speed; of encoder or observer, electrical */
    uint32_t angle_offset_q32; /* from that angle to the rotor's; 0 with the observer */
    const int32_t *sine;       /* lib/trig.h */
    /* references: by current_loop_set_currents(); docs/contexts.md */
    int32_t i_d_ref_q15;
    int32_t i_q_ref_q15;
    /* controllers: steps per LSB of current; 0 while the bridge is off */
    int32_t kp_d_q9;
    int32_t kp_q_q9;
    int32_t integral_d_q9;
    int32_t integral_q_q9;
    int32_t turn_q15; /* how far the frame turns until the voltages act, radians */
    int32_t ki_q15;   /* of both axes, per sample */
    /* the last sample, and the voltages it led to; both in the rotor's frame, the voltages' at the time they act */
    int32_t i_d_q15;
    int32_t i_q_q15;
    int32_t v_d_steps;
    int32_t v_q_steps;
    uint32_t encoder_scale_q32;                   /* electrical turns per count */
    uint32_t status_max;                          /* a gate status above this is a fault; all ones while none counts */
    uint32_t field_angle_q32;                     /* of LOOP_FORCED: at the next sample */
    int32_t field_speed_q32;                      /* added each sample */
    uint16_t circle_steps[1 << LOOP_CIRCLE_BITS]; /* largest |v_q| for a given v_d */

    /* which instance runs: by current_loop_select(), _exchange(), _divert(), _install() */
    const struct loop_handlers *handlers; /* NULL: no interrupt */
    uint32_t source;
    void (**diverted)(void); /* the handler's address while the vector has another entry; else NULL */

    /* once a millisecond */
    int32_t vbus_q15;
    int32_t v_d_q15, v_q_q15; /* the voltages, 1.0 = v_range */
    int32_t radius_q15;       /* largest voltage the modulator gets from the bus */
    int32_t feedforward_d_steps, feedforward_q_steps;
    int32_t ripple_q10;            /* from the tuning: if not 0, the C handlers run, which use dead_shift */
    uint32_t dead_shift;           /* full dead-time compensation starts at 2^dead_shift times the knee */
    const struct tuning *gains_of; /* source of the gains, NULL: none set; and their bus voltage */
    int32_t gains_vbus_q15;
    int32_t kp_q_rated_q9;  /* of q without kp + ki: for saturating iron, at rated current */
    int32_t loops_per_slow; /* samples a millisecond */
    uint32_t w_shift;       /* from speed per sample, Q32, to per PWM period, w_q15 */
    int32_t turn_per_w_q15; /* how far the frame turns until the voltages act, at a speed of 1.0 */
    int32_t v_turn_q15;     /* how far v_d and v_q lead the rotor's frame when they act */
    struct loop_weakening weaken;
    uint32_t fell_back; /* milliseconds, since the tuning, in which the newest voltage had to wait for an end */

    uint32_t locked_out; /* not 0: a fault is latched, and the gates stay off (bridge.h) */

    /* of LOOP_OBSERVER and LOOP_INJECTION */
    uint32_t field_follows; /* all ones: field_angle_q32 counts from the observed angle; 0: it is prescribed */
    struct observer flux;
    struct injection inject; /* of LOOP_INJECTION */
};

/* Whether the rotor's angle is found without an encoder; see field_follows. Any context. */
static inline bool current_loop_finds_rotor(const volatile struct current_loop *c)
{
    return c->source >= LOOP_OBSERVER;
}

/* Electrical speed of the rotor: Q15, 1.0 = CONFIG_SPEED_BASE_HZ. Any context. */
static inline int32_t current_loop_w_q15(const volatile struct current_loop *c)
{
    return q15_sat16(c->pll.speed_q32 >> c->w_shift);
}

/* Electrical angle of the frame in which the currents are regulated. Any context. */
static inline uint32_t current_loop_angle_q32(const volatile struct current_loop *c)
{
    if (c->source == LOOP_ENCODER) {
        return c->pll.angle_q32 + c->angle_offset_q32;
    }
    return c->field_angle_q32 + (current_loop_finds_rotor(c) ? c->pll.angle_q32 & c->field_follows : 0u);
}

/* The same for display. */
static inline uint32_t current_loop_angle_u16(const volatile struct current_loop *c)
{
    return current_loop_angle_q32(c) >> 16;
}

/* Whether controllers and thresholds are active. Any context. */
static inline bool current_loop_is_on(const volatile struct current_loop *c)
{
    return c->status_max != UINT32_MAX;
}

/* The state before the first use. Thread, once. */
void current_loop_init(struct current_loop *c);

/*
 * Access from outside to a running loop is by these functions only (tests/tools/lint.py); exceptions: observer.c, injection.c,
 * weakening.c and bridge.h for their own parts. The interrupt reads each word at its next sample; two words of one call may
 * take effect a sample apart. Slow loop, or with the bridge off, unless noted.
 */

/* Current references: Q15 of i_range, d and q in the field's frame. The scope's sampler adds to them, too. */
static inline void current_loop_set_i_d(volatile struct current_loop *c, int32_t i_d_q15)
{
    c->i_d_ref_q15 = i_d_q15;
}

static inline void current_loop_set_i_q(volatile struct current_loop *c, int32_t i_q_q15)
{
    c->i_q_ref_q15 = i_q_q15;
}

static inline void current_loop_set_currents(volatile struct current_loop *c, int32_t i_d_q15, int32_t i_q_q15)
{
    current_loop_set_i_d(c, i_d_q15);
    current_loop_set_i_q(c, i_q_q15);
}

/* The controllers' integrals, in voltage steps, Q9: with zero gains the voltage that is held. */
static inline void current_loop_hold_d(volatile struct current_loop *c, int32_t v_d_q9)
{
    c->integral_d_q9 = v_d_q9;
}

static inline void current_loop_hold_q(volatile struct current_loop *c, int32_t v_q_q9)
{
    c->integral_q_q9 = v_q_q9;
}

static inline void current_loop_hold(volatile struct current_loop *c, int32_t v_d_q9, int32_t v_q_q9)
{
    current_loop_hold_d(c, v_d_q9);
    current_loop_hold_q(c, v_q_q9);
}

/* Zero voltage, without feed-forward. */
static inline void current_loop_drop_voltage(volatile struct current_loop *c)
{
    current_loop_hold(c, 0, 0);
    c->feedforward_d_steps = 0;
    c->feedforward_q_steps = 0;
}

/* Offset from the encoder's count to the field's angle, 2^32 a turn. */
static inline void current_loop_offset(volatile struct current_loop *c, uint32_t offset_q32)
{
    c->angle_offset_q32 = offset_q32;
}

/* Speed of a prescribed field: 2^32 a turn, per sample. */
static inline void current_loop_field_speed(volatile struct current_loop *c, int32_t speed_q32)
{
    c->field_speed_q32 = speed_q32;
}

/* The estimated rotor: angle, 2^32 a turn, and speed, per sample. */
static inline void current_loop_set_rotor(volatile struct current_loop *c, uint32_t angle_q32)
{
    c->pll.angle_q32 = angle_q32;
}

static inline void current_loop_run(volatile struct current_loop *c, int32_t speed_q32)
{
    c->pll.speed_q32 = speed_q32;
}

static inline void current_loop_place(volatile struct current_loop *c, uint32_t angle_q32, int32_t speed_q32)
{
    current_loop_set_rotor(c, angle_q32);
    current_loop_run(c, speed_q32);
}

/* Adds to both, between two samples. */
void current_loop_correct(volatile struct current_loop *c, uint32_t by_angle_q32, int32_t by_speed_q32);

/* Adds to the speed alone, without masking the interrupt. */
static inline void current_loop_accelerate(volatile struct current_loop *c, int32_t by_speed_q32)
{
    cpu_add(&c->pll.speed_q32, by_speed_q32);
}

/*
 * Whether the field's angle is relative to the estimated rotor's (all ones) or absolute (0). For LOOP_HALL, after its
 * selection.
 */
static inline void current_loop_count_from_rotor(volatile struct current_loop *c, uint32_t follows)
{
    c->field_follows = follows;
}

/* The controllers' gains, until current_loop_follow() sets the tuning's. With zero gains the integrals are constant. */
static inline void current_loop_gains(volatile struct current_loop *c, int32_t kp_d_q9, int32_t kp_q_q9, int32_t ki_q15)
{
    c->ki_q15 = ki_q15;
    c->kp_d_q9 = kp_d_q9;
    c->kp_q_q9 = kp_q_q9;
}

/*
 * Dead-time compensation: full, or none (a knee so wide that no current reaches it). For a tuning without ripple; with ripple,
 * current_loop_follow() sets the knee.
 */
static inline void current_loop_compensate(volatile struct current_loop *c, bool on)
{
    c->dead_shift = on ? 0u : 31u;
}

/* Sets the tuning's ripple to zero, until the next current_loop_tune(). */
static inline void current_loop_forget_ripple(volatile struct current_loop *c)
{
    c->ripple_q10 = 0;
}

/* Clears the state of an earlier injection. */
static inline void current_loop_forget_injection(volatile struct current_loop *c)
{
    c->inject.track = 0;
}

/* The gates have been disabled: their status is no longer checked. From the interrupt, or with it masked. */
static inline void current_loop_disarm(volatile struct current_loop *c)
{
    c->status_max = UINT32_MAX;
}

/* The interrupt's instances for this loop. Thread, once, before the interrupt is enabled. */
static inline void current_loop_install(volatile struct current_loop *c, const struct loop_handlers *handlers)
{
    c->handlers = handlers;
}

/* Settings that do not depend on the bus voltage: encoder scale, sampling rate. Slow loop or thread, bridge off. */
void current_loop_tune(volatile struct current_loop *c, const struct tuning *t);

/* Activates or deactivates controllers and thresholds together. Slow loop. */
void current_loop_on(volatile struct current_loop *c, struct fabric *f, const struct tuning *t);
void current_loop_off(volatile struct current_loop *c, struct fabric *f);

/*
 * For LOOP_OBSERVER and LOOP_HALL, for a turning rotor whose angle and speed are in `pll`: as current_loop_on(), but in the
 * rotor's frame, with the EMF already in the integrals; the gates stay off, so that the PWM outputs the EMF before they are
 * enabled (bridge_enable()). Slow loop.
 */
void current_loop_arm(volatile struct current_loop *c, struct fabric *f, const struct tuning *t);

/*
 * Selects the instance of the interrupt. Only while the bridge is off; otherwise returns false without effect, because the
 * integrals are in the previous source's frame. Slow loop.
 */
bool current_loop_select(volatile struct current_loop *c, const struct fabric *f, enum loop_source source);

/*
 * From LOOP_OBSERVER to LOOP_INJECTION or back, while the bridge is on: both share frame, angle, speed and integrals. One
 * store. Slow loop.
 */
void current_loop_exchange(volatile struct current_loop *c, enum loop_source source);

/*
 * From LOOP_ENCODER to LOOP_OBSERVER while the bridge is on: advances the currents' frame by `turn_q32` at the next sample and
 * turns it by `speed_q32` a sample until the rotor is followed. Converts voltages, references and measurements to it. Slow
 * loop, or the current loop's interrupt after its work; holds the interrupt back meanwhile.
 */
void current_loop_coast(volatile struct current_loop *c, uint32_t turn_q32, int32_t speed_q32);

/*
 * From any source but LOOP_FORCED to LOOP_ENCODER, LOOP_OBSERVER or LOOP_HALL, bridge on: at the next sample the rotor's angle
 * is `rotor` plus `offset_q32`, which is 0 without an encoder. Turns the frame by the difference as in current_loop_coast().
 * Slow loop, right after a sample; holds the interrupt back for about 150 cycles.
 */
void current_loop_hand_over(volatile struct current_loop *c, enum loop_source source, const struct pll *rotor,
                            uint32_t offset_q32);

/*
 * From the next sample on the interrupt enters `entry`, which must continue to the handler in `*handler`; undivert restores the
 * handler. Selections made meanwhile go to `*handler`. Requires `handlers`. Thread or slow loop, bridge on or off.
 */
void current_loop_divert(volatile struct current_loop *c, void (*entry)(void), void (**handler)(void));
void current_loop_undivert(volatile struct current_loop *c);

/*
 * For LOOP_FORCED: the field is at `angle_q32` at the next sample and turns by `speed_q32` a sample until set otherwise. `pll`
 * keeps following the encoder. Slow loop, bridge on or off.
 */
void current_loop_field(volatile struct current_loop *c, uint32_t angle_q32, int32_t speed_q32);

/*
 * For LOOP_OBSERVER and LOOP_INJECTION: the currents' frame becomes the observed rotor's; or it advances by `turn_q32` and
 * turns by `speed_q32` a sample. Voltages and references are converted to the new frame: the motor sees no change. Slow loop,
 * bridge on; holds the interrupt back for about 100 cycles.
 */
void current_loop_follow_rotor(volatile struct current_loop *c);
void current_loop_prescribe(volatile struct current_loop *c, uint32_t turn_q32, int32_t speed_q32);

/*
 * As current_loop_follow(), after a change of frame: recalculates the feed-forward part of the present voltages; the voltages
 * stay. Slow loop; holds the interrupt back for about 300 cycles.
 */
void current_loop_restart_feedforward(volatile struct current_loop *c, const struct fabric *f, const struct tuning *t);

/* Gains and feed-forward for the present bus voltage, speed and references. Slow loop, every millisecond, last. */
void current_loop_follow(volatile struct current_loop *c, const struct fabric *f, const struct tuning *t);

/* The rotor's angle at a time of the encoder's clock, and its speed. */
struct rotor_seed {
    uint32_t angle_q32;
    uint32_t clock;
    int32_t speed_q32; /* a sample */
};

#endif

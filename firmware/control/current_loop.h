/* SPDX-License-Identifier: MIT */
/*
 * The current loop: the end-of-conversion interrupt, once or twice a PWM period, the most urgent one.
 *
 * current_loop_step.h is the interrupt's work in C, one instance for each source of the field's angle and each scheme of
 * sensing; the one for the encoder and two sensors stands in assembly as well (current_loop_isr.S), because it is quicker.
 * Which one runs the vector says: current_loop_select(). The interrupt works with what the slow loop prepares once a
 * millisecond: gains for the present bus voltage, the feed-forward, thresholds (they stand in the ADC block). What it believes
 * can be watched in the structure while the motor turns.
 *
 * The interrupt breaks into everything else, so less urgent code takes the structure as volatile: then every access is
 * made, once, and in the order that is written.
 *
 * Inside the loop voltages are in steps of 2^-CONFIG_V_SHIFT counts of half the on-time. So the bus voltage is in the gains,
 * and what the bus can give is a constant.
 */
#ifndef FIRMWARE_CONTROL_CURRENT_LOOP_H
#define FIRMWARE_CONTROL_CURRENT_LOOP_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/fabric/fabric.h"
#include "firmware/control/current_loop_layout.h"
#include "firmware/control/injection.h"
#include "firmware/control/observer.h"
#include "firmware/settings/tuning.h"
#include "lib/pll.h"
#include "lib/q15.h"

#define LOOP_V_D_MAX_STEPS (1 << (LOOP_V_D_BITS - 1))

/*
 * The largest turn, at 0.62 CONFIG_SPEED_BASE_HZ for 1.5 periods, at 0.41 where the circle is large; beyond it the voltages
 * lag. Larger ones could turn a saturated voltage back inside the circle, where the integral would not see that it is limited:
 * make prove.
 */
#define LOOP_TURN_MAX_Q15 (CONFIG_RADIUS_STEPS > 23200 ? 8000 : 11900)

/* Where the field's angle comes from. */
enum loop_source {
    LOOP_ENCODER, /* the rotor's, by the encoder */
    LOOP_FORCED,  /* current_loop_field(), whatever the rotor does */
    LOOP_OBSERVER, /* the rotor's by the flux observer; or prescribed as well, while the observer finds it: field_follows */
    LOOP_INJECTION, /* the same by the saliency, to which a voltage is added */
    LOOP_HALL,      /* the same by Hall switches: hall.h */
    LOOP_SOURCES,
};

/* Which phase currents are measured. */
enum loop_scheme {
    LOOP_SENSE_AB,   /* a and b: sensors in line with the phases */
    LOOP_SENSE_PAIR, /* two of three, current_loop_pair(): shunts, of which one may be blind */
    LOOP_SCHEMES,
};

/* The two bits say whose place the sum of the others takes. */
enum loop_pair {
    LOOP_PAIR_AB = 0,
    LOOP_PAIR_BC = INT32_MIN,
    LOOP_PAIR_CA = 1 << 30,
};

/* An axis's instances of the interrupt, and the vector that chooses one of them. */
struct loop_handlers {
    void (**vector)(void);
    void (*handler[LOOP_SOURCES][LOOP_SCHEMES])(void);
    void (*weakening[LOOP_SCHEMES])(void); /* in place of [LOOP_ENCODER], where the field is weakened */
    void (*overmodulating)(void);          /* in place of weakening[LOOP_SENSE_AB], beyond the modulator's circle */
    void (*rippled)(void);                 /* in place of [LOOP_ENCODER][LOOP_SENSE_AB], whose dead_shift is 0 */
};

/* What the instances for field weakening (stage_weaken.h) know besides. */
struct loop_weakening {
    bool on;                 /* of the tuning: they serve */
    uint32_t turn_q32;       /* by how much the frame turns until the voltages act: as turn_q15, without its limit */
    int32_t radius_steps;    /* of the circle of voltages: the modulator's, or overmodulation.h's */
    int32_t q_first;         /* which axis takes of the circle first, the other the rest: all ones q, 0 d */
    int32_t first_max_steps; /* so much at most */
    int32_t gain_q15;        /* retreat, LSB of current per step that v_q lacks; its sign is that of w */
    int32_t gain_share_q8;   /* of the current loops' gains; 256 within the modulator's circle */
    int32_t most_q15;        /* largest retreat */
    int32_t room_q_steps; /* what a steady d leaves to v_q, and a step of its reference: less is no reason to retreat */
    int32_t kick_steps;   /* of room_q_steps: the controller's answer to steps of the q reference */
    int32_t i_q_ref_before_q15; /* of the last millisecond */
    int32_t retreat_q22;        /* by how much i_d stays below its reference, Q15 with 7 more bits */
};

struct current_loop {
    struct pll pll;            /* angle predicted for the next sample, and speed; of encoder or observer, electrical */
    uint32_t angle_offset_q32; /* from that angle to the rotor's; 0 with the observer */
    const int32_t *sine;       /* lib/trig.h */
    /* references: written by the slow loop */
    int32_t i_d_ref_q15;
    int32_t i_q_ref_q15;
    /* controllers: steps per LSB of current; 0 while the bridge is off */
    int32_t kp_d_q9;
    int32_t kp_q_q9;
    int32_t integral_d_q9;
    int32_t integral_q_q9;
    int32_t turn_q15; /* by how much the frame turns until the voltages act, radians */
    int32_t ki_q15;   /* of both axes, per sample */
    /* the last sample in the rotor's frame, and the voltages that answer it, in the rotor's frame when they act */
    int32_t i_d_q15;
    int32_t i_q_q15;
    int32_t v_d_steps;
    int32_t v_q_steps;
    uint32_t encoder_scale_q32;                   /* electrical turns per count */
    uint32_t status_max;                          /* a gate status above this is a fault; all ones while none counts */
    int32_t pair;                                 /* enum loop_pair */
    uint32_t field_angle_q32;                     /* of LOOP_FORCED: at the next sample */
    int32_t field_speed_q32;                      /* and a sample later so much more */
    uint16_t circle_steps[1 << LOOP_CIRCLE_BITS]; /* largest |v_q| beside v_d */

    /* which instance runs: current_loop_select() alone writes these */
    const struct loop_handlers *handlers; /* NULL: nobody's interrupt */
    uint32_t source, scheme;
    void (**diverted)(
        void); /* where the handler's address is kept while another entry is in the vector; NULL: none is */

    /* once a millisecond */
    int32_t vbus_q15;
    int32_t v_d_q15, v_q_q15; /* the voltages, 1.0 = v_range */
    int32_t radius_q15;       /* largest voltage that the modulator makes of the bus */
    int32_t feedforward_d_steps, feedforward_q_steps;
    int32_t ripple_q10;  /* of the tuning: where there is any, C handlers serve, which know dead_shift */
    uint32_t dead_shift; /* the current from which dead time is compensated in full is 2^dead_shift times the knee */
    const struct tuning *gains_of; /* what the gains are from, NULL: none are set; and the bus voltage they are for */
    int32_t gains_vbus_q15;
    int32_t kp_q_rated_q9;  /* of q without kp + ki: where iron saturates, at rated current */
    int32_t loops_per_slow; /* samples a millisecond */
    uint32_t w_shift;       /* from a speed a sample, Q32, to one a PWM period, w_q15 */
    int32_t turn_per_w_q15; /* by how much the frame turns until the voltages act, at a speed of 1.0 */
    int32_t v_turn_q15;     /* and by how much v_d and v_q are turned ahead of the rotor's frame when they act */
    struct loop_weakening weaken;
    uint32_t fell_back; /* milliseconds since the tuning in which the newest voltage had to wait for an end */

    /* of LOOP_OBSERVER and LOOP_INJECTION */
    uint32_t field_follows; /* all ones: field_angle_q32 counts from the observed angle; 0: it is prescribed */
    struct observer flux;
    struct injection inject; /* of LOOP_INJECTION */
};

/* Whether the rotor's angle is found without an encoder, in field_follows. Any context. */
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

/* Whether the controllers work and the thresholds count. Any context. */
static inline bool current_loop_is_on(const volatile struct current_loop *c)
{
    return c->status_max != UINT32_MAX;
}

/* The state before the first use. Thread, once. */
void current_loop_init(struct current_loop *c);

/* Takes what does not depend on the bus: the encoder's scale, how often it is sampled. Slow loop or thread, bridge off. */
void current_loop_tune(volatile struct current_loop *c, const struct tuning *t);

/* From now on the controllers work and the thresholds count, or neither does. Slow loop. */
void current_loop_on(volatile struct current_loop *c, struct fabric *f, const struct tuning *t);
void current_loop_off(volatile struct current_loop *c, struct fabric *f);

/*
 * Of LOOP_OBSERVER and LOOP_HALL, for a rotor that turns, whose angle and speed `pll` has: as current_loop_on(), but in the
 * rotor's frame and with the EMF in the integrals at once; and the gates stay what they are, so that the legs play it before
 * they are opened (gate_enable()). Slow loop.
 */
void current_loop_arm(volatile struct current_loop *c, struct fabric *f, const struct tuning *t);

/*
 * Chooses the instance of the interrupt. Only while the bridge is off; otherwise returns false, and nothing has changed: the
 * integrals hold what they learnt in the frame of the source before. Slow loop.
 */
bool current_loop_select(volatile struct current_loop *c, const struct fabric *f, enum loop_source source,
                         enum loop_scheme scheme);

/*
 * From LOOP_OBSERVER to LOOP_INJECTION or back, while the bridge is on: both have the same frame, angle and speed, and the same
 * integrals. One store. Slow loop.
 */
void current_loop_exchange(volatile struct current_loop *c, enum loop_source source);

/*
 * From LOOP_ENCODER to LOOP_OBSERVER while the bridge is on: the frame of the currents stands by `turn_q32` further on at the
 * next sample, and turns by `speed_q32` a sample until the rotor is followed. Voltages, references and what was measured are
 * expressed in it. Slow loop, or the current loop's interrupt when it has done its work; holds it back while it does.
 */
void current_loop_coast(volatile struct current_loop *c, uint32_t turn_q32, int32_t speed_q32);

/*
 * From a source of the rotor's angle, any but LOOP_FORCED, to LOOP_ENCODER, LOOP_OBSERVER or LOOP_HALL, the bridge on: at
 * the next sample the rotor stands at `rotor` and `offset_q32`, which is 0 but with an encoder. What differs is turned as in
 * current_loop_coast(). Slow loop, right behind a sample; holds the interrupt back for about 150 cycles.
 */
void current_loop_hand_over(volatile struct current_loop *c, enum loop_source source, const struct pll *rotor,
                            uint32_t offset_q32);

/*
 * From the next sample on the interrupt enters `entry`, which has to go on to the handler in `*handler`; or the handler itself
 * again. Whatever is selected meanwhile goes there. Not without `handlers`. Thread or slow loop, bridge on or off.
 */
void current_loop_divert(volatile struct current_loop *c, void (*entry)(void), void (**handler)(void));
void current_loop_undivert(volatile struct current_loop *c);

/*
 * Of LOOP_FORCED: the field stands at `angle_q32` at the next sample and turns by `speed_q32` a sample from there, until told
 * otherwise. The rotor's angle and speed in `pll` go on following the encoder. Slow loop, bridge on or off.
 */
void current_loop_field(volatile struct current_loop *c, uint32_t angle_q32, int32_t speed_q32);

/*
 * Of LOOP_OBSERVER and LOOP_INJECTION: the frame of the currents is the observed rotor's from now on; or it stands by
 * `turn_q32` further on and turns by `speed_q32` a sample. Voltages and references stay what they are, expressed in the new
 * frame: the motor notices nothing. Slow loop, bridge on; holds the interrupt back for about 100 cycles.
 */
void current_loop_follow_rotor(volatile struct current_loop *c);
void current_loop_prescribe(volatile struct current_loop *c, uint32_t turn_q32, int32_t speed_q32);

/* The rotor stands at this electrical angle now: from here on the encoder tells it. Slow loop. */
void current_loop_set_rotor(volatile struct current_loop *c, uint32_t angle_q32);

/*
 * As current_loop_follow(), after another frame has been taken: what of the present voltages is feed-forward is reckoned anew,
 * and the voltages stay. Slow loop; holds the interrupt back for about 300 cycles.
 */
void current_loop_adopt(volatile struct current_loop *c, const struct fabric *f, const struct tuning *t);

/* Of LOOP_SENSE_PAIR: the two currents to use from the next sample on; one store. Slow loop, bridge on or off. */
static inline void current_loop_pair(volatile struct current_loop *c, enum loop_pair pair)
{
    c->pair = pair;
}

/* Gains and feed-forward for the present bus voltage, speed and references. Slow loop, every millisecond, last. */
void current_loop_follow(volatile struct current_loop *c, const struct fabric *f, const struct tuning *t);

#endif

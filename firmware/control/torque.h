/* SPDX-License-Identifier: MIT */
/*
 * From a wish for torque to i_d and i_q: the one place that speed control, torque control and every stop ask. Once a
 * millisecond, in the slow loop.
 *
 * Limits by construction: each limiter yields an interval that contains 0 (interval.h), and the wish is clamped to what they
 * leave in common. Nothing is added after that, so no limiter can turn a torque round.
 *
 *   current   i_max, or less if the thermal model asks for it; but never less than what a flux limit takes without torque
 *   voltage   the most torque of the flux that the bus voltage carries at the present speed (flux_limit.h): the field is
 *             weakened, up to the most torque per voltage (weakening.h)
 *   power     power_max_w driving, regen_max_w braking
 *   bus       braking only: what keeps the bus voltage below v_max, whatever the supply takes back
 *   speed     torque control only: the speed controller's own proportional part towards speed_max, so as stable as that is
 *
 * The bus. Of the power that braking puts in, a part goes away (windings, iron, chopper, supply) and the rest charges the
 * capacitor: dW/dt = P - S, W = C v^2 / 2. S is observed from the two others. Allowed is what S takes, and in each
 * millisecond a quarter of the energy that was missing up to v_set, 4 % below v_max, when the limits were worked out, so half
 * of it until they are anew: the voltage creeps up to v_set and stays, whatever S is (compare Hur, Jung, Nam: "A fast dynamic
 * DC-link power-balancing scheme for a PWM converter-inverter system", IEEE Trans. Ind. Electron. 48(4), 2001). S contains the
 * losses, so neither R nor friction need be known.
 *
 * Where the bus allows less than is wished, a current against the magnets burns power in the windings: it makes no torque,
 * lowers the voltage, and S grows by it. It ends where it cancels the magnets' flux.
 */
#ifndef FIRMWARE_CONTROL_TORQUE_H
#define FIRMWARE_CONTROL_TORQUE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/current_loop.h"
#include "firmware/control/flux_limit.h"
#include "firmware/control/interval.h"
#include "firmware/control/weakening.h"
#include "firmware/settings/torque_map.h"
#include "firmware/settings/tuning.h"
#include "lib/usually.h"

/* Below this speed braking is free: what a rotor gives back there is less than its windings take. */
#define TORQUE_BRAKING_FREE_RPM_Q4 (30 * 16)

/* Power is per unit, Q15: 1.0 = 1.5 v_range i_range. Energy: what that brings in a slow period, with 10 more bits. */
struct torque_control {
    int32_t torque_q15;     /* asked for in the last step, after the limits */
    struct interval limits; /* what the limiters leave in common */
    struct interval bus;    /* what the bus alone allows */
    int32_t i_limit_q15;    /* of the currents' amplitude */
    int32_t emf_q15;        /* power that a torque of 1.0 makes at the speed of the last measurement */
    int32_t vbus_q15;       /* of the last measurement */
    int32_t energy_q25;     /* of the bus capacitor */
    int32_t sink_q18;       /* power that goes away while the motor brakes; >= 0 */
    int32_t asked_q15;      /* torque, sum of the steps since the last measurement */
    int32_t burn_q15;       /* d current against the magnets that makes no torque; >= 0 */
    bool plain;        /* torque is i_q, and there is no more to it: no saliency, nothing burns, no flux limit near */
    bool flux_is_near; /* so that it is followed each millisecond */
    struct flux_limit flux;
    struct weakening_row row; /* of that limit: where it decides */
    struct torque_map map;    /* these two: of the last switching on (torque_build.h) */
    struct weakening weakening;
};

/* What the limits depend on besides speed and voltage. */
struct torque_view {
    int32_t speed_rpm_q4;
    int32_t i_limit_q15; /* of the thermal model; i_max where it sets none */
    bool limit_speed;
};

/*
 * Watches the bus, and whether the flux has a limit, by a bus voltage of now: the current loop's is a period old. Every
 * second slow period, whatever the state.
 */
void torque_measure(struct torque_control *s, const volatile struct current_loop *c, const struct tuning *t,
                    int32_t vbus_q15);

/* The flux limit alone: in the slow periods between, where there may be one. */
void torque_follow_flux(struct torque_control *s, const volatile struct current_loop *c, const struct tuning *t,
                        int32_t vbus_q15);

static inline bool torque_flux_is_near(const struct torque_control *s, const struct tuning *t)
{
    return s->flux_is_near || t->weakens;
}

/* Works out s->limits. Every second slow period in operation, after the measurement and before a wish is made. */
void torque_set_limits(struct torque_control *s, const struct tuning *t, const struct torque_view *v);

/* Sets both current references for the wish, as far as the limits go. */
void torque_ask(struct torque_control *s, volatile struct current_loop *c, const struct tuning *t, int32_t wish_q15);

/* The same where it is not plain: by the maps. */
void torque_ask_map(struct torque_control *s, volatile struct current_loop *c, const struct tuning *t,
                    int32_t wish_q15);

/* Whether nothing but the bus holds the wish back. */
static inline bool torque_bus_decides(const struct torque_control *s, int32_t wish_q15, int32_t torque_q15)
{
    return wish_q15 != torque_q15 && (torque_q15 == s->bus.low || torque_q15 == s->bus.high);
}

/* torque_ask() as a part of its caller. */
static inline __attribute__((always_inline)) void
torque_ask_at_once(struct torque_control *s, volatile struct current_loop *c, const struct tuning *t, int32_t wish_q15)
{
    const int32_t torque_q15 = interval_clamp(s->limits, wish_q15);
    if (SELDOM(!s->plain || torque_bus_decides(s, wish_q15, torque_q15))) {
        torque_ask_map(s, c, t, wish_q15);
        return;
    }
    s->torque_q15 = torque_q15;
    s->asked_q15 += torque_q15;
    c->i_d_ref_q15 = 0;
    c->i_q_ref_q15 = torque_q15;
}

/* The bridge goes off. */
void torque_rest(struct torque_control *s);

#endif

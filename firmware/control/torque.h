/* SPDX-License-Identifier: MIT */
/*
 * Turns a torque demand into i_d and i_q, for speed control, torque control and every stop alike. Once a millisecond, in the
 * slow loop.
 *
 * Limits by construction: each limiter yields an interval that contains 0 (interval.h), and the demand is clamped to their
 * intersection. Nothing is added after that, so no limiter can reverse a torque.
 *
 *   current   i_max, or less if the thermal model says so; but never less than a flux limit needs without torque
 *   voltage   the most torque of the flux the bus voltage allows at the present speed (weakening.h): the field is
 *             weakened, up to the most torque per voltage (weakening.h)
 *   power     power_max_w driving, regen_max_w braking
 *   bus       braking only: keeps the bus voltage below v_max, whatever the supply takes back
 *   speed     torque control only: the speed controller's own proportional part towards speed_max, so equally stable
 *
 * The bus. Part of the braking power is dissipated or taken back (windings, iron, chopper, supply), the rest charges the
 * capacitor: dW/dt = P - S, W = C v^2 / 2. S is observed from the other two. The limit is S plus, in each millisecond, a
 * quarter of the energy missing to v_set, 4 % below v_max, when the limits were calculated, so half of it until the next
 * calculation: the voltage creeps up to v_set and stays, whatever S is (compare Hur, Jung, Nam: "A fast dynamic DC-link
 * power-balancing scheme for a PWM converter-inverter system", IEEE Trans. Ind. Electron. 48(4), 2001). S includes the losses,
 * so R and friction need not be known.
 *
 * If the bus allows less than demanded, a current against the magnets burns power in the windings: it makes no torque, lowers
 * the voltage and increases S. Its limit is where it cancels the magnets' flux, or burns what braking would return. Between
 * v_set and v_max, as on a full battery, braking is allowed what the windings burn, by the resistance that was told.
 */
#ifndef FIRMWARE_CONTROL_TORQUE_H
#define FIRMWARE_CONTROL_TORQUE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/current_loop.h"
#include "firmware/control/interval.h"
#include "firmware/control/weakening.h"
#include "firmware/settings/mtpa.h"
#include "firmware/settings/tuning.h"

/* Below this speed braking is unlimited: the rotor returns less than its windings dissipate. */
#define TORQUE_BRAKING_FREE_RPM_Q4 (30 * 16)

/* Power is per unit, Q15: 1.0 = 1.5 v_range i_range. Energy: that power over a slow period, with 10 more bits. */
struct torque_control {
    int32_t torque_q15;     /* set in the last step, after the limits */
    int32_t probe_q15;      /* added to what is asked for: scope/sweep.h */
    struct interval limits; /* intersection of all limiters */
    struct interval bus;    /* the bus's alone, */
    struct interval others; /* and the others' */
    int32_t i_limit_q15;    /* of the currents' amplitude */
    int32_t emf_q15;        /* power of a torque of 1.0 at the last measured speed */
    int32_t vbus_q15;       /* of the last measurement */
    int32_t energy_q25;     /* of the bus capacitor */
    int32_t sink_q18;       /* power dissipated or taken back while the motor brakes; >= 0 */
    int32_t demand_sum_q15; /* torque, sum of the steps since the last measurement */
    int32_t return_q19;     /* power that braking would return without the bus's limit: a mean; driving: negative */
    int32_t copper_q15;     /* power that the present currents burn */
    int32_t burn_q15;       /* d current against the magnets that makes no torque; >= 0 */
    bool flux_is_near;      /* so it is followed each millisecond */
    struct flux_limit flux;
    struct weakening_row row; /* of that limit: when it decides */
    struct torque_map map;    /* these two: from the last switch-on (torque_build.h) */
    struct weakening weakening;
};

/* Further inputs of the limits. */
struct torque_view {
    int32_t speed_rpm_q4;
    int32_t i_limit_q15; /* of the thermal model; i_max if it sets none */
    bool limit_speed;
};

/*
 * Observes the bus and whether the flux is limited, from the present bus voltage: the current loop's is a period old. Every
 * second slow period, in any state.
 */
void torque_measure(struct torque_control *s, const volatile struct current_loop *c, const struct tuning *t,
                    int32_t vbus_q15);

/* Only the flux limit: in the slow periods between, if one may apply. */
void torque_follow_flux(struct torque_control *s, const volatile struct current_loop *c, const struct tuning *t,
                        int32_t vbus_q15);

static inline bool torque_flux_is_near(const struct torque_control *s, const struct tuning *t)
{
    return s->flux_is_near || t->weakens;
}

/* Calculates s->limits. Every second slow period in operation, after the measurement and before the demand. */
void torque_set_limits(struct torque_control *s, const struct tuning *t, const struct torque_view *v);

/* Sets both current references for the demand, within the limits. */
void torque_ask(struct torque_control *s, volatile struct current_loop *c, const struct tuning *t, int32_t demand_q15);

/* The bridge goes off. */
void torque_reset(struct torque_control *s);

#endif

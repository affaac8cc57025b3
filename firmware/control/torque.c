/* SPDX-License-Identifier: MIT */
#include "firmware/control/torque.h"

#include "firmware/control/stage_weaken.h"
#include "firmware/settings/features.h"
#include "firmware/settings/scale.h"
#include "lib/limit.h"
#include "lib/q15.h"

#define SINK_SHIFT    3 /* time constant of the observed power: 8 ms */
#define MISSING_SHIFT 2 /* a quarter of the missing energy in a period */
#define TOP_SHIFT     6 /* five 64ths more energy than at v_set: 99.7 % of v_max */
#define BURN_SHIFT    4 /* from 0 to i_max in 16 periods */
#define FADE_SHIFT    4 /* and back in 16 times as many: the observed power must not lag */
#define MEAN_SHIFT    4 /* over 16 periods: what swings about no power is none to be burnt, */
#define LEAST_SHIFT   6 /* nor is a 64th of the largest: torque that ripples with a turn */

static int32_t bus_energy_q25(int32_t vbus_q15, const struct tuning *t)
{
    return ((vbus_q15 * vbus_q15) >> 15) * t->bus_energy_q10;
}

/* From the power fed into the bus in two milliseconds and the change of its energy. */
static void observe_sink(struct torque_control *s, int32_t energy_q25)
{
    const int32_t growth_q15 = (energy_q25 - s->energy_q25) >> 10;
    const int32_t power_q15 = (s->demand_sum_q15 * s->emf_q15) >> 15;
    const int32_t sink_q18 = s->sink_q18 - power_q15 - growth_q15 - (s->sink_q18 >> (SINK_SHIFT - 1));
    s->sink_q18 = q15_clamp(sink_q18, 0, Q15_ONE << SINK_SHIFT);
    s->energy_q25 = energy_q25;
    s->demand_sum_q15 = 0;
}

void torque_follow_flux(struct torque_control *s, const volatile struct current_loop *c, const struct tuning *t,
                        int32_t vbus_q15)
{
    const int32_t power_q15 = (s->torque_q15 * s->emf_q15) >> 15;
    s->vbus_q15 = vbus_q15;
    s->flux_is_near = flux_limit_follow(&s->flux, c, t, vbus_q15, power_q15, s->weakening.top_q15);
    if (s->flux.flux_q15 != FLUX_UNLIMITED) {
        s->row = weakening_row(&s->weakening, s->flux.flux_q15);
    }
}

void torque_measure(struct torque_control *s, const volatile struct current_loop *c, const struct tuning *t,
                    int32_t vbus_q15)
{
    s->emf_q15 = q15_sat16((current_loop_w_q15(c) * t->torque_emf_q11) >> 11);
    observe_sink(s, bus_energy_q25(vbus_q15, t));
    torque_follow_flux(s, c, t, vbus_q15);
}

static struct interval current_limits(const struct torque_control *s, const struct tuning *t)
{
    int32_t size_q15 = s->map.torque_max_q15;
    if (s->i_limit_q15 < t->i_max_q15) {
        size_q15 = q15_min(size_q15, torque_map_reach(&s->map, s->map.current_q15, s->i_limit_q15));
    }
    if (s->flux.flux_q15 != FLUX_UNLIMITED) {
        size_q15 = q15_min(size_q15, weakening_torque(&s->row, s->i_limit_q15));
    }
    return interval_both_ways(size_q15);
}

static int32_t torque_of_power(int32_t power_q15, uint32_t emf_q15)
{
    return (uint32_t)power_q15 >= emf_q15 ? Q15_ONE : (int32_t)(((uint32_t)power_q15 << 15) / emf_q15);
}

/*
 * The torques of these powers at the present EMF. At rest its sign is noise: without any braking the shaft could not start to
 * turn.
 */
static struct interval power_limits(const struct torque_control *s, int32_t speed_rpm_q4, int32_t driving_q15,
                                    int32_t braking_q15)
{
    const bool rests = q15_abs(speed_rpm_q4) < TORQUE_BRAKING_FREE_RPM_Q4;
    const uint32_t emf_q15 = (uint32_t)q15_abs(s->emf_q15);
    const int32_t drive_q15 = torque_of_power(driving_q15, emf_q15);
    const int32_t brake_q15 = rests ? Q15_ONE : torque_of_power(braking_q15, emf_q15);
    return s->emf_q15 < 0 ? (struct interval){-drive_q15, brake_q15} : (struct interval){-brake_q15, drive_q15};
}

/* The heat of these currents in the windings. */
static int32_t copper_q15(const struct tuning *t, int32_t i_d_q15, int32_t i_q_q15)
{
    const int32_t square_q15 = ((i_d_q15 * i_d_q15) >> 15) + ((i_q_q15 * i_q_q15) >> 15);
    return scale_clamp(((int64_t)t->r_q12 * square_q15) >> 12, 0, Q15_ONE);
}

/*
 * Above v_set a supply that is full allows nothing, so nothing would be returned and no sink be seen. What the windings burn
 * never reaches the bus; if it did, by a resistance told too large, the bus would stop rising below v_max.
 */
static struct interval bus_limits(const struct torque_control *s, const struct tuning *t, int32_t speed_rpm_q4)
{
    const int32_t set_q25 = t->bus_set_energy_q25;
    const int32_t top_q25 = set_q25 + (set_q25 >> TOP_SHIFT) * 5;
    const int32_t sink_q15 = s->sink_q18 >> SINK_SHIFT;
    const int32_t missing_q15 = (set_q25 - s->energy_q25) >> (10 + MISSING_SHIFT);
    const int32_t left_q15 = (top_q25 - s->energy_q25) >> (10 + MISSING_SHIFT);
    const int32_t allowed_q15 = sink_q15 + q15_max(missing_q15, q15_min(s->copper_q15 - sink_q15, left_q15));
    return power_limits(s, speed_rpm_q4, INT32_MAX, q15_clamp(allowed_q15, 0, 2 * Q15_ONE - 1));
}

static struct interval speed_limits(const struct tuning *t, int32_t speed_rpm_q4)
{
    const int32_t room_rpm_q4 = t->speed_max_rpm_q4 - q15_abs(speed_rpm_q4);
    const int64_t faster_q16 = (int64_t)q15_max(room_rpm_q4, 0) * t->speed_kp_q16;
    return interval_one_way(speed_rpm_q4, scale_clamp(faster_q16 >> 16, 0, Q15_ONE), Q15_ONE);
}

void torque_set_limits(struct torque_control *s, const struct tuning *t, const struct torque_view *v)
{
    s->i_limit_q15 = q15_clamp(v->i_limit_q15, 0, t->i_max_q15);
    s->bus = bus_limits(s, t, v->speed_rpm_q4);
    s->others =
        interval_meet(current_limits(s, t), power_limits(s, v->speed_rpm_q4, t->power_max_q15, t->regen_max_q15));
    if (v->limit_speed) {
        s->others = interval_meet(s->others, speed_limits(t, v->speed_rpm_q4));
    }
    s->limits = interval_meet(s->others, s->bus);
}

/* Burns while the bus alone limits braking, and no more than that would return. */
static void follow_burn(struct torque_control *s, const struct tuning *t, int32_t demand_q15)
{
    const int32_t asked_q15 = interval_clamp(s->others, demand_q15);
    const int32_t return_q19 = s->return_q19 - (s->return_q19 >> MEAN_SHIFT) - ((asked_q15 * s->emf_q15) >> 15);
    const int32_t most_q15 = (q15_abs(s->emf_q15) * t->i_max_q15) >> 15;
    s->return_q19 = q15_max(return_q19, -most_q15); /* it soon is above 0 again */
    const int32_t step_q15 = (t->i_max_q15 >> BURN_SHIFT) + 1;
    const int32_t returned_q15 = (s->return_q19 >> MEAN_SHIFT) - (most_q15 >> LEAST_SHIFT);
    const int32_t more_q15 = q15_min(s->burn_q15 + step_q15, t->burn_max_q15);
    if (interval_clamp(s->bus, asked_q15) != asked_q15 && copper_q15(t, more_q15, 0) <= returned_q15) {
        s->burn_q15 = more_q15;
    } else {
        const bool too_much = copper_q15(t, s->burn_q15, 0) > returned_q15;
        s->burn_q15 = q15_max(s->burn_q15 - (step_q15 >> (too_much ? 1 : FADE_SHIFT)) - 1, 0);
    }
}

/* The q current for the torque at a d current other than the map's: torque over psi - (L_q - L_d) i_d. */
static int32_t i_q_beside(const struct tuning *t, int32_t torque_q15, int32_t i_d_q15)
{
    const int32_t flux_q11 = (t->emf_q12 >> 1) - ((t->saliency_q11 * i_d_q15) >> 15);
    return torque_q15 * t->torque_emf_q11 / q15_max(flux_q11, 1);
}

/* Burning keeps the amplitude within its limit and corrects for reluctance torque. It never strengthens the field. */
static void set_burning(const struct torque_control *s, volatile struct current_loop *c, const struct tuning *t,
                        int32_t i_d_q15, int32_t i_q_q15)
{
    const int32_t rest_q15 = circle_rest_q15(i_q_q15, s->i_limit_q15);
    const int32_t most_q15 = q15_min(rest_q15, t->burn_max_q15);
    const int32_t burning_q15 = q15_min(q15_max(i_d_q15 - s->burn_q15, -most_q15), i_d_q15);
    const int32_t q_q15 = i_q_beside(t, s->torque_q15, burning_q15);
    current_loop_set_currents(c, burning_q15, q15_clamp(q_q15, -q15_abs(i_q_q15), q15_abs(i_q_q15)));
}

/* The currents of least amplitude, unless their flux exceeds what the voltage allows. */
static struct weakening_node currents_for(struct torque_control *s, int32_t torque_q15)
{
    s->flux.decides =
        s->flux.flux_q15 != FLUX_UNLIMITED && torque_map_at(&s->map, s->map.flux_q15, torque_q15) > s->flux.flux_q15;
    return s->flux.decides ? weakening_currents(&s->row, torque_q15) : weakening_least_current(&s->map, torque_q15);
}

/*
 * With limited flux, torque grows only as fast as the reserve voltage can move its currents: a step would need unavailable
 * voltage, first in q. While the motor brakes with excess voltage, torque does not grow at all: the flux limit is about to
 * fall, and is slower than the torque.
 */
static int32_t reachable(const struct torque_control *s, const struct tuning *t, int32_t torque_q15)
{
    if (s->flux.flux_q15 == FLUX_UNLIMITED ||
        torque_map_at(&s->map, s->map.flux_q15, q15_abs(torque_q15)) <= s->flux.flux_q15) {
        return torque_q15;
    }
    const int32_t step_q15 = s->flux.exceeded ? 0 : flux_limit_slew_q15(t, s->vbus_q15);
    return q15_clamp(torque_q15, q15_min(s->torque_q15, 0) - step_q15, q15_max(s->torque_q15, 0) + step_q15);
}

/*
 * While braking takes more than half of the circle in v_d, torque does not fall faster than the reserve moves its current,
 * either: a step of the q reference takes the voltage that holds d, which then runs away. Before the limits, which hold.
 */
static int32_t released(const struct torque_control *s, const volatile struct current_loop *c, const struct tuning *t,
                        int32_t demand_q15)
{
    const bool brakes = (s->torque_q15 ^ s->emf_q15) < 0;
    if (!FEATURE_IN(WEAKENING) || !c->weaken.on || c->weaken.q_first == 0 || !brakes) {
        return demand_q15;
    }
    const int32_t step_q15 = flux_limit_slew_q15(t, s->vbus_q15);
    return s->torque_q15 < 0 ? q15_min(demand_q15, s->torque_q15 + step_q15)
                             : q15_max(demand_q15, s->torque_q15 - step_q15);
}

void torque_ask(struct torque_control *s, volatile struct current_loop *c, const struct tuning *t, int32_t demand_q15)
{
    const int32_t released_q15 = released(s, c, t, demand_q15 + s->probe_q15);
    s->torque_q15 = reachable(s, t, interval_clamp(s->limits, released_q15));
    follow_burn(s, t, released_q15);
    const struct weakening_node i = currents_for(s, q15_abs(s->torque_q15));
    s->torque_q15 = s->torque_q15 < 0 ? -i.torque_q15 : i.torque_q15;
    s->demand_sum_q15 += s->torque_q15;
    if (s->burn_q15 > 0) {
        set_burning(s, c, t, i.i_d_q15, i.i_q_q15);
    } else {
        const int32_t i_q_q15 = s->torque_q15 == 0 ? 0 : i.i_q_q15; /* rounding may make it 1 at no torque */
        current_loop_set_currents(c, i.i_d_q15, s->torque_q15 < 0 ? -i_q_q15 : i_q_q15);
    }
    s->copper_q15 = copper_q15(t, c->i_d_ref_q15, c->i_q_ref_q15);
    if (FEATURE_IN(WEAKENING) && c->weaken.on) {
        flux_limit_guide(c, t, s->vbus_q15);
    }
}

void torque_reset(struct torque_control *s)
{
    s->torque_q15 = 0;
    s->probe_q15 = 0;
    s->demand_sum_q15 = 0;
    s->burn_q15 = 0;
    s->return_q19 = 0;
    s->copper_q15 = 0;
    flux_limit_reset(&s->flux);
}

/* SPDX-License-Identifier: MIT */
/*
 * Torque measurement and limits (torque.h), inlined into their caller: calls would take a fifth of their time. Rare cases stay
 * in torque.c.
 */
#ifndef FIRMWARE_CONTROL_TORQUE_STEP_H
#define FIRMWARE_CONTROL_TORQUE_STEP_H

#include "firmware/control/torque.h"
#include "lib/q15.h"
#include "lib/usually.h"

#define TORQUE_SINK_SHIFT    3 /* time constant of the observed power: 8 ms */
#define TORQUE_MISSING_SHIFT 2 /* a quarter of the missing energy in a period */

/* Rare: the flux is limited, or about to be; less current than i_max, or that flux; much power; torque control. */
void torque_near_flux(struct torque_control *s, const volatile struct current_loop *c, const struct tuning *t,
                      int32_t vbus_q15);
struct interval torque_limits_of_currents(const struct torque_control *s, const struct tuning *t, int32_t i_limit_q15);
struct interval torque_limits_of_power(const struct torque_control *s, const struct tuning *t, int32_t speed_rpm_q4);
struct interval torque_limits_of_speed(const struct tuning *t, int32_t speed_rpm_q4);

static inline int32_t torque_bus_energy_q25(int32_t vbus_q15, const struct tuning *t)
{
    return ((vbus_q15 * vbus_q15) >> 15) * t->bus_energy_q10;
}

/* From the power fed into the bus in two milliseconds and the change of its energy. */
static inline void torque_observe_sink(struct torque_control *s, int32_t energy_q25)
{
    const int32_t growth_q15 = (energy_q25 - s->energy_q25) >> 10;
    const int32_t power_q15 = (s->asked_q15 * s->emf_q15) >> 15;
    const int32_t sink_q18 = s->sink_q18 - power_q15 - growth_q15 - (s->sink_q18 >> (TORQUE_SINK_SHIFT - 1));
    s->sink_q18 = q15_clamp(sink_q18, 0, Q15_ONE << TORQUE_SINK_SHIFT);
    s->energy_q25 = energy_q25;
    s->asked_q15 = 0;
}

static inline __attribute__((always_inline)) void torque_look_at_flux(struct torque_control *s,
                                                                      const volatile struct current_loop *c,
                                                                      const struct tuning *t, int32_t w_q15,
                                                                      int32_t vbus_q15)
{
    const bool near = !flux_limit_is_far(&s->flux, c, w_q15, vbus_q15, s->weakening.top_q15);
    s->vbus_q15 = vbus_q15;
    s->flux_is_near = near;
    s->plain = !near && s->burn_q15 == 0 && s->map.plain && !t->weakens;
    if (SELDOM(near)) {
        torque_near_flux(s, c, t, vbus_q15);
    } else {
        flux_limit_rest(&s->flux);
    }
}

static inline __attribute__((always_inline)) void torque_measure_here(struct torque_control *s,
                                                                      const volatile struct current_loop *c,
                                                                      const struct tuning *t, int32_t vbus_q15)
{
    const int32_t w_q15 = current_loop_w_q15(c);
    s->emf_q15 = q15_sat16((w_q15 * t->torque_emf_q11) >> 11);
    torque_observe_sink(s, torque_bus_energy_q25(vbus_q15, t));
    torque_look_at_flux(s, c, t, w_q15, vbus_q15);
}

static inline struct interval torque_limits_of_bus(const struct torque_control *s, const struct tuning *t,
                                                   int32_t speed_rpm_q4)
{
    if (q15_abs(speed_rpm_q4) < TORQUE_BRAKING_FREE_RPM_Q4) {
        return interval_both_ways(Q15_ONE);
    }
    const int32_t missing_q15 = (t->bus_set_energy_q25 - s->energy_q25) >> (10 + TORQUE_MISSING_SHIFT);
    const int32_t allowed_q15 = q15_clamp(missing_q15 + (s->sink_q18 >> TORQUE_SINK_SHIFT), 0, 2 * Q15_ONE - 1);
    const int32_t size_q15 = q15_abs(s->emf_q15);
    if (allowed_q15 >= size_q15) {
        return interval_both_ways(Q15_ONE);
    }
    const int32_t braking_q15 = (int32_t)(((uint32_t)allowed_q15 << 15) / (uint32_t)size_q15);
    return s->emf_q15 < 0 ? (struct interval){-Q15_ONE, braking_q15} : (struct interval){-braking_q15, Q15_ONE};
}

/* Whether the power limits allow a torque of +-1.0 or more. */
static inline bool torque_power_is_free(const struct torque_control *s, const struct tuning *t)
{
    return q15_abs(s->emf_q15) <= q15_min(t->power_max_q15, t->regen_max_q15);
}

static inline __attribute__((always_inline)) void
torque_set_limits_here(struct torque_control *s, const struct tuning *t, const struct torque_view *v)
{
    const int32_t i_limit_q15 = q15_clamp(v->i_limit_q15, 0, t->i_max_q15);
    const bool all = s->flux.flux_q15 == FLUX_UNLIMITED && i_limit_q15 == t->i_max_q15;
    s->i_limit_q15 = i_limit_q15;
    struct interval limits = USUALLY(all) ? (struct interval){-s->map.torque_max_q15, s->map.torque_max_q15}
                                          : torque_limits_of_currents(s, t, i_limit_q15);
    s->bus = torque_limits_of_bus(s, t, v->speed_rpm_q4);
    limits = interval_meet(limits, s->bus);
    if (SELDOM(!torque_power_is_free(s, t))) {
        limits = interval_meet(limits, torque_limits_of_power(s, t, v->speed_rpm_q4));
    }
    if (SELDOM(v->limit_speed)) {
        limits = interval_meet(limits, torque_limits_of_speed(t, v->speed_rpm_q4));
    }
    s->limits = limits;
}

#endif

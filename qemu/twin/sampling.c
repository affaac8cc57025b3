/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "sampling.h"

#include "legs.h"

/* The part of a leg's current that the sensor of channel k carries. */
static double carried_a(const struct plant *p, int k, const double i_leg_a[3])
{
    const int leg = p->sensors.shows[k];
    return p->sensors.p.shunt != 0 ? leg_low_side_a(&p->inverter, leg, i_leg_a[leg]) : i_leg_a[leg];
}

static void see(const struct plant *p, double at_ps, const double i_a[3], double share[3])
{
    for (int k = 0; k < 3; k++) {
        share[k] = sensors_current_share(&p->sensors, k, at_ps * 1e-12, carried_a(p, k, i_a));
    }
}

void sampling_follow(void *plant, double dt_s, const double from_a[3], const double to_a[3])
{
    struct plant *p = plant;
    meter_add(&p->meter, dt_s, from_a, to_a, motor_torque_nm(&p->motor));
    bool modulated = p->sensors.p.modulators != 0 && p->fabric->ops->modulate;
    struct stretch seen = {.from_ps = p->stepped_ps, .to_ps = p->stepped_ps + dt_s * 1e12};
    p->stepped_ps = seen.to_ps;
    if (modulated) {
        see(p, seen.from_ps, from_a, seen.from);
    }
    if (p->sensors.follows) {
        struct leg_view leg[3];
        for (int k = 0; k < 3; k++) {
            leg[k] = (struct leg_view){carried_a(p, k, from_a), carried_a(p, k, to_a),
                                       leg_level(&p->inverter, p->sensors.shows[k])};
        }
        sensors_follow(&p->sensors, leg, dt_s);
    }
    if (modulated) {
        see(p, seen.to_ps, to_a, seen.to);
        p->fabric->ops->modulate(p->fabric, &seen);
    }
}

static void find_next(struct plant *p)
{
    p->next_sample = SIM_NEVER;
    for (int k = 0; k < 3; k++) {
        p->next_sample = p->sample_at[k] < p->next_sample ? p->sample_at[k] : p->next_sample;
    }
}

void sampling_take(struct plant *p)
{
    double i_a[3];
    inverter_leg_currents(&p->inverter, &p->motor, i_a);
    for (int k = 0; k < 3; k++) {
        if (p->sample_at[k] <= p->now) {
            p->sample_at[k] = SIM_NEVER;
            uint32_t code = sensors_current_code(&p->sensors, k, sim_to_s(p->now), carried_a(p, k, i_a));
            p->fabric->ops->sample(p->fabric, k, code);
        }
    }
    find_next(p);
}

void sampling_start(struct plant *p)
{
    const struct sensor_params *s = &p->sensors.p;
    sensors_draw_noise(&p->sensors);
    uint32_t code[4] = {[3] = sensors_bus_code(&p->sensors, p->inverter.bus_v)};
    p->fabric->ops->convert(p->fabric, code, p->now);
    p->sample_at[0] = p->now;
    p->sample_at[1] = p->now + sim_from_s(s->skew_b_s);
    p->sample_at[2] = p->now + sim_from_s(s->skew_c_s);
    sampling_take(p);
}

void sampling_forget(struct plant *p)
{
    for (int k = 0; k < 3; k++) {
        p->sample_at[k] = SIM_NEVER;
    }
    find_next(p);
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Between two events nothing in the fabric changes, so the inverter integrates from one to the next. Events at the same
 * time are taken in the order of the signal path: comparators, PWM edges, samples, ends of conversions, switches. */
#include "plant.h"

#include <string.h>

#include "sampling.h"

#define SLOT_BYTES 0x100u
#define SQRT3      1.7320508075688772
#define ACCESS_PS  (8 * SIM_PS_PER_FABRIC_CLOCK)

enum { SLOT_PWM, SLOT_ADC, SLOT_ENCODER };

static void follow_gates(struct plant *p, sim_ps at);

void plant_init(struct plant *p, const struct plant_params *params)
{
    memset(p, 0, sizeof *p);
    motor_init(&p->motor, &params->motor, &params->load);
    inverter_init(&p->inverter, &params->inverter);
    sensors_init(&p->sensors, &params->sensors, params->seed);
    thermometer_init(&p->thermometer, &params->motor, p->motor.winding_c);
    p->inverter.on_step = sampling_follow;
    p->inverter.on_step_context = p;
    fabric_model_init(&p->model, sim_from_s(params->sensors.adc_conversion_s), params->inverter.in_en != 0);
    p->fabric = params->fabric ? params->fabric : &p->model.fabric;
    plant_reset_fabric(p);
}

void plant_join(struct plant *p, unsigned axis, unsigned axes, const struct plant *leader)
{
    fabric_model_join(&p->model, axis, axes, leader ? &leader->model : NULL);
}

bool plant_waits(const struct plant *p)
{
    return p->fabric->ops->waits(p->fabric);
}

/* The shaft as it was at `from`, when the physics went on from there to the present. */
static void follow_shaft(struct plant *p, sim_ps from, double from_rad, double from_rad_s)
{
    struct disc *disc = &p->sensors.disc;
    const struct motor *m = &p->motor;
    int64_t edges = disc_edges(disc, m->theta_rad), moved = edges - p->edges;
    if (moved == 0) {
        return;
    }
    struct disc_way of_disc = {from_rad, m->theta_rad, from_rad_s, m->speed_rad_s, sim_to_s(p->now - from)};
    double part = disc_edge_part(disc, &of_disc, moved);
    struct shaft_way way = {edges, moved, disc_miscounts(disc, moved), from,
                            (double)from + part * (double)(p->now - from)};
    p->fabric->ops->turn(p->fabric, &way, &disc->index);
    p->edges = edges;
}

void plant_reset_fabric(struct plant *p)
{
    p->edges = disc_edges(&p->sensors.disc, p->motor.theta_rad);
    p->fabric->ops->reset(p->fabric, p->now);
    sampling_forget(p);
    follow_gates(p, p->now);
}

static void count_high_time(struct plant *p, sim_ps until)
{
    for (int k = 0; k < 3; k++) {
        p->high_time[k] += p->gates & GATE_HIGH(k) ? until - p->high_counted : 0;
    }
    p->high_counted = until;
}

static void command_gates(struct plant *p, sim_ps at)
{
    count_high_time(p, at);
    p->gates = p->fabric->gates;
    inverter_command(&p->inverter, p->gates, at);
}

static void follow_gates(struct plant *p, sim_ps at)
{
    command_gates(p, at);
    inverter_switch(&p->inverter, p->now);
    inverter_chop(&p->inverter, p->fabric->chops);
}

void plant_stop(struct plant *p, enum gate_latch which, bool stops)
{
    p->fabric->ops->stop(p->fabric, which, stops, p->now);
    follow_gates(p, p->now);
}

/* ---- a row for the recorder, then the sample ---- */

static void describe_period(struct plant *p, struct plant_row *row)
{
    struct meter_reading r;
    meter_read(&p->meter, &r);
    memcpy(row->i_mean_a, r.i_mean_a, sizeof row->i_mean_a);
    memcpy(row->i_rms_a, r.i_rms_a, sizeof row->i_rms_a);
    memcpy(row->i_peak_a, r.i_peak_a, sizeof row->i_peak_a);
    row->torque_mean_nm = r.torque_mean_nm;
}

static void describe(struct plant *p, struct plant_row *row)
{
    const struct motor *m = &p->motor;
    double length_s = sim_to_s(p->now - p->row_start);
    double alpha_v = length_s > 0 ? (m->volt_alpha_vs - p->row_alpha_vs) / length_s : 0;
    double beta_v = length_s > 0 ? (m->volt_beta_vs - p->row_beta_vs) / length_s : 0;
    row->t_s = sim_to_s(p->now);
    row->v_mean_v[0] = alpha_v;
    row->v_mean_v[1] = -0.5 * alpha_v + SQRT3 / 2 * beta_v;
    row->v_mean_v[2] = -0.5 * alpha_v - SQRT3 / 2 * beta_v;
    motor_currents(m, row->i_a);
    row->theta_mech_rad = m->theta_rad;
    row->speed_rad_s = m->speed_rad_s;
    row->torque_nm = motor_torque_nm(m);
    row->load_nm = m->load_nm + m->hoist_nm;
    row->bus_v = p->inverter.bus_v;
    count_high_time(p, p->now);
    for (int k = 0; k < 3; k++) {
        row->duty[k] = length_s > 0 ? sim_to_s(p->high_time[k]) / length_s : 0;
        p->high_time[k] = 0;
    }
    row->gates = p->gates;
    row->live = p->fabric->live;
    row->winding_c = m->winding_c;
    row->load_speed_rad_s = m->load_speed_rad_s;
    row->magnet_c = motor_magnet_c(m);
    row->hall = p->hall;
    describe_period(p, row);
    p->row_start = p->now;
    p->row_alpha_vs = m->volt_alpha_vs;
    p->row_beta_vs = m->volt_beta_vs;
}

static void show_hall(struct plant *p)
{
    struct hall *h = &p->sensors.hall;
    double electrical_rad = p->motor.p.pole_pairs * p->motor.theta_rad;
    double electrical_rad_s = p->motor.p.pole_pairs * p->motor.speed_rad_s;
    bool turned = hall_follow(h, electrical_rad) && electrical_rad_s != 0;
    unsigned state = hall_wires(h);
    if (state != p->hall) {
        double ago_s = turned ? hall_since_rad(h, electrical_rad, electrical_rad_s > 0) / electrical_rad_s : 0;
        p->hall = state;
        p->fabric->ops->show_hall(p->fabric, state, (double)p->now - 1e12 * ago_s);
    }
}

static void trigger(struct plant *p)
{
    thermometer_follow(&p->thermometer, p->motor.winding_c, p->now);
    if (p->fabric->ops->listens(p->fabric)) {
        sampling_start(p);
    }
    if (p->on_trigger) {
        struct plant_row row = {0};
        describe(p, &row);
        p->on_trigger(p->context, &row);
    }
}

/* ---- events ---- */

/* A motor in RTL goes with the fabric's clock. */
static void follow_motor(struct plant *p)
{
    if (p->fabric->follow_motor) {
        p->fabric->follow_motor(p->fabric, p);
    }
}

/* The integration need not stop there. A comparator that trips before such an edge is found after it; inverter_command() puts
 * that right. */
static bool needs_no_physics(const struct plant *p, sim_ps next)
{
    return next == p->fabric->ops->next_event(p->fabric) && !p->fabric->ops->needs_physics(p->fabric);
}

static void take_edge(struct plant *p, sim_ps at)
{
    (void)p->fabric->ops->take_event(p->fabric);
    if (p->fabric->gates != p->gates) {
        command_gates(p, at);
    }
}

static void take_fabric_event(struct plant *p)
{
    show_hall(p);
    unsigned what = p->fabric->ops->take_event(p->fabric);
    follow_motor(p);
    follow_gates(p, p->now);
    if (what & FABRIC_TRIGGERED) {
        trigger(p);
    }
    if (what & FABRIC_CONVERTED) {
        p->fabric->ops->sense(p->fabric, thermometer_code(&p->thermometer));
    }
}

static void integrate(struct plant *p, sim_ps to)
{
    if (p->fabric->follow_motor) {
        p->now = to;
        return;
    }
    bool was_tripped = p->inverter.overcurrent;
    sim_ps from = p->now;
    double from_rad = p->motor.theta_rad, from_rad_s = p->motor.speed_rad_s;
    p->stepped_ps = (double)from;
    p->now = inverter_advance(&p->inverter, &p->motor, from, to);
    follow_shaft(p, from, from_rad, from_rad_s);
    if (p->inverter.overcurrent != was_tripped) {
        plant_stop(p, GATE_OVERCURRENT, p->inverter.overcurrent);
    }
}

static sim_ps earlier(sim_ps a, sim_ps b)
{
    return a < b ? a : b;
}

static sim_ps next_event(const struct plant *p)
{
    return earlier(earlier(p->fabric->ops->next_event(p->fabric), p->next_sample), inverter_next_switch(&p->inverter));
}

/* Takes the events up to and including `to`; the physics stays at the last of them. */
static void take_events(struct plant *p, sim_ps to)
{
    for (sim_ps next = next_event(p); next <= to; next = next_event(p)) {
        if (needs_no_physics(p, next)) {
            take_edge(p, next);
            continue;
        }
        if (next > p->now) {
            integrate(p, next);
            if (p->now < next) {
                continue; /* the comparators tripped on the way: that may have added an earlier event */
            }
        }
        if (next == p->fabric->ops->next_event(p->fabric)) {
            take_fabric_event(p);
        } else if (next == p->next_sample) {
            sampling_take(p);
        } else {
            inverter_switch(&p->inverter, p->now);
        }
    }
}

void plant_advance(struct plant *p, sim_ps to)
{
    take_events(p, to);
    while (p->now < to) {
        integrate(p, to);
        take_events(p, to); /* a trip opens the switches after their delay */
    }
    p->fabric->ops->catch_up(p->fabric, to);
    follow_motor(p);
}

sim_ps plant_next_trigger(const struct plant *p)
{
    return p->fabric->ops->next_trigger(p->fabric);
}

sim_ps plant_next_conversion_end(const struct plant *p)
{
    return p->fabric->ops->next_conversion_end(p->fabric);
}

/* ---- registers ---- */

/* PWM and ADC change at events only, so that an access to them need not interrupt the integration, unless the fabric is prompt;
 * position and comparators follow the physics all the time. */
static void reach(struct plant *p, uint32_t slot, sim_ps now)
{
    if (!p->fabric->prompt && (slot == SLOT_PWM || slot == SLOT_ADC)) {
        take_events(p, now);
    } else {
        plant_advance(p, now);
    }
}

/* An access takes a prompt fabric a few clocks ahead, in which it must not wait for a sample. */
static sim_ps time_of_access(const struct plant *p, sim_ps now)
{
    bool waits = p->fabric->prompt && p->next_sample < now + ACCESS_PS;
    return waits && p->next_sample > now ? p->next_sample : now;
}

/* What came up during an access is taken with it. */
static void follow_access(struct plant *p)
{
    if (p->fabric->ahead > p->now) {
        take_events(p, p->fabric->ahead);
    }
}

uint32_t plant_read(struct plant *p, uint32_t offset, sim_ps now)
{
    uint32_t slot = offset / SLOT_BYTES;
    sim_ps at = time_of_access(p, now);
    reach(p, slot, at);
    if (slot == SLOT_ENCODER) {
        show_hall(p);
    }
    uint32_t value = p->fabric->ops->read(p->fabric, offset, at);
    follow_access(p);
    return value;
}

void plant_write(struct plant *p, uint32_t offset, uint32_t value, sim_ps now)
{
    sim_ps at = time_of_access(p, now);
    reach(p, offset / SLOT_BYTES, at);
    p->fabric->ops->write(p->fabric, offset, value, at);
    if (p->fabric->gates != p->gates) {
        follow_gates(p, p->now);
    }
    inverter_chop(&p->inverter, p->fabric->chops);
    if (!p->fabric->ops->converting(p->fabric)) {
        sampling_forget(p);
    }
    follow_access(p);
}

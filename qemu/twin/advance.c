/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Between two changes of a leg the circuit is linear (circuit.h) and the motor integrates it. A leg changes when a
 * switch does, when the current of a conducting diode reaches zero (found by secant steps, to a microampere), when a
 * swinging node or a floating terminal reaches a rail (settled before every step). Comparators trip at the instant they
 * are found to. */
#include <math.h>
#include <string.h>

#include "circuit.h"
#include "coss.h"
#include "diodes.h"
#include "inverter.h"
#include "terminals.h"

#define LONGEST_STEP_S  10e-6
#define LEAST_BUS_SHARE 0.1 /* of the supply's voltage: below it, a quotient of energy and voltage says little */

/* The events to be located in a step: diodes whose current may end, and currents that reach the comparators' level. */
struct watch {
    bool diode[3];
    bool level[3];
};

struct step {
    struct inverter *inv;
    const struct motor *before;
    struct bridge_load load; /* at the start */
    struct bus_view bus;
    struct watch watch;
    double i_start_a[3];
    double margin_start_a;
    struct circuit circuit;
    struct motor after;
    double i_a[3];   /* leg currents at the end */
    double margin_a; /* at the end */
};

/* ---- one step, and the instants inside it ---- */

/* What the bridge draws from the bus. */
static struct bridge_load load_of(const struct inverter *inv, const double i_a[3])
{
    struct bridge_load load = {0, 0};
    for (int k = 0; k < 3; k++) {
        load.current_a += circuit_bus_share(inv->leg[k]) * i_a[k];
        load.conductance_s += inv->leg[k] == LEG_BOTH ? 1 / (2 * inv->p.r_on_ohm) : 0;
    }
    if (inv->supply.plain) {
        load.current_a += load.conductance_s * inv->bus_v;
        load.conductance_s = 0;
    }
    return load;
}

static double total_a(const struct bridge_load *load, double bus_v)
{
    return load->current_a + load->conductance_s * bus_v;
}

static struct watch watch_for(const struct inverter *inv, const double i_start_a[3])
{
    struct watch w;
    for (int k = 0; k < 3; k++) {
        w.diode[k] = (inv->leg[k] == LEG_DIODE_LO && i_start_a[k] > DIODE_ZERO_A) ||
                     (inv->leg[k] == LEG_DIODE_HI && i_start_a[k] < -DIODE_ZERO_A);
        w.level[k] = !inv->comparators.tripped && !comparators_beyond(inv, k);
    }
    return w;
}

/* Distance to the first of those events: negative once one is past. */
static double event_margin(const struct inverter *inv, const struct watch *w, const double i_a[3])
{
    double margin_a = INFINITY;
    for (int k = 0; k < 3; k++) {
        if (w->diode[k]) {
            margin_a = fmin(margin_a, inv->leg[k] == LEG_DIODE_LO ? i_a[k] : -i_a[k]);
        }
        if (w->level[k]) {
            margin_a = fmin(margin_a, inv->p.oc_trip_a - fabs(i_a[k]));
        }
    }
    return margin_a;
}

static void try_step(struct step *st, double dt_s)
{
    double i_motor_a[3];
    st->after = *st->before;
    terminals_step(st->inv, &st->after, &st->circuit.source, dt_s);
    terminals_currents(st->inv, &st->after, i_motor_a);
    circuit_leg_currents(st->inv, &st->circuit, i_motor_a, st->i_a);
    st->margin_a = event_margin(st->inv, &st->watch, st->i_a);
}

/* The bus of the middle of the step serves for all of it: second order, like the mean of the drawn current. */
static void prepare(struct step *st, double dt_s)
{
    st->bus = supply_middle(&st->inv->supply, &st->inv->p, st->load, dt_s);
    circuit_build(st->inv, st->bus, dt_s, &st->circuit);
}

/* Whether another length of the step is another circuit. A plain bus moves too little for that. */
static bool depends_on_length(const struct inverter *inv)
{
    return !inv->supply.plain || coss_swings(inv);
}

static void try_length(struct step *st, double dt_s)
{
    if (depends_on_length(st->inv)) {
        prepare(st, dt_s);
    }
    try_step(st, dt_s);
}

/* Shortens a step that overshot so that it ends just past the event (regula falsi, Illinois variant). */
static double locate_event(struct step *st, double dt_s)
{
    const double past_a = DIODE_ZERO_A / 2; /* aim beyond zero, so that the event has surely happened */
    double t0 = 0, f0 = st->margin_start_a + past_a, t1 = dt_s, f1 = st->margin_a + past_a;
    for (int n = 0; n < 60 && fabs(f1) > past_a * 0.99; n++) {
        double t = t0 + (t1 - t0) * f0 / (f0 - f1);
        try_length(st, t);
        double f = st->margin_a + past_a;
        if (fabs(f) < past_a * 0.99) {
            return t;
        }
        if (f > 0) {
            t0 = t;
            f0 = f;
            f1 /= 2;
        } else {
            t1 = t;
            f1 = f;
            f0 /= 2;
        }
    }
    try_length(st, t1);
    return t1;
}

static double longest_step_s(const struct step *st)
{
    const struct inverter *inv = st->inv;
    double inductance_h = terminals_inductance_h(st->before);
    double dt_s = fmin(LONGEST_STEP_S, motor_max_step_s(st->before, st->circuit.r_max_ohm));
    dt_s = fmin(dt_s, 0.1 * sqrt(inductance_h * inv->p.bus_capacitance_f));
    dt_s = fmin(dt_s, inv->supply.longest_step_s);
    if (inv->short_from >= 0) {
        dt_s = fmin(dt_s, LONGEST_JOINED_STEP_S);
    }
    for (int k = 0; k < 3; k++) {
        if (inv->leg[k] == LEG_BOTH) {
            dt_s = fmin(dt_s, fmax(0.1 * inv->p.r_on_ohm * inv->p.bus_capacitance_f, 1e-9));
        }
    }
    return coss_swings(inv) ? fmin(dt_s, coss_longest_step_s(inv, st->before, st->i_start_a)) : dt_s;
}

/* ---- the step is taken ---- */

/* Heat of the switches and diodes over a step in which every current is a straight line. */
static double conduction_j(const struct step *st, double bus_v, double dt_s)
{
    const struct inverter_params *p = &st->inv->p;
    double power_w = 0;
    for (int k = 0; k < 3; k++) {
        double mean_a = (st->i_start_a[k] + st->i_a[k]) / 2, half_a = (st->i_a[k] - st->i_start_a[k]) / 2;
        double square_a2 = mean_a * mean_a + half_a * half_a / 3;
        switch (st->inv->leg[k]) {
        case LEG_HIGH:
        case LEG_LOW:
            power_w += circuit_switch_w(st->inv, k, mean_a, square_a2);
            break;
        case LEG_DIODE_LO:
        case LEG_DIODE_HI:
            power_w += p->diode_v * fabs(mean_a) + p->diode_ohm * square_a2;
            break;
        case LEG_BOTH:
            power_w += (bus_v * bus_v / p->r_on_ohm + p->r_on_ohm * square_a2) / 2;
            break;
        default:
            break;
        }
    }
    return power_w * dt_s;
}

/* Mean of what the legs draw from the bus. The motor integrates its energy to the fourth order; what went into it, into
 * heat and into the nodes says more than the ends of the current would, which is no straight line: with 30 uH and 10 us,
 * those are off by a thousandth. The plain supply makes do with them, so that an ideal plant is what it always was. */
static double mean_current_a(const struct step *st, double ends_a, double used_j, double dt_s)
{
    const struct inverter *inv = st->inv;
    double bus_v = st->bus.open_v - st->bus.ohm * ends_a;
    bool both = inv->leg[0] == LEG_BOTH || inv->leg[1] == LEG_BOTH || inv->leg[2] == LEG_BOTH;
    if (inv->supply.plain || ends_a == 0 || both || inv->short_from >= 0 || bus_v < LEAST_BUS_SHARE * inv->p.vbus_v) {
        return ends_a;
    }
    return used_j / (bus_v * dt_s);
}

/* Brings supply and energies to the end of the step; stored_j more is in the nodes. */
static void account(struct step *st, double stored_j, double dt_s)
{
    struct inverter *inv = st->inv;
    inv->bus_v = st->bus.open_v - st->bus.ohm * st->load.current_a;
    double heat_j = conduction_j(st, inv->bus_v, dt_s), motor_j = st->after.energy_in_j - st->before->energy_in_j;
    struct bridge_load end = load_of(inv, st->i_a);
    double ends_a = (st->load.current_a + end.current_a) / 2;
    struct bridge_load mean = {mean_current_a(st, ends_a, motor_j + heat_j + stored_j, dt_s), end.conductance_s};
    struct supply_flow flow = supply_step(&inv->supply, &inv->p, mean, st->bus, dt_s);
    inv->energy_supply_j += flow.source_j;
    inv->energy_bridge_j += flow.bus_v * total_a(&mean, flow.bus_v) * dt_s;
    inv->energy_conduction_j += heat_j;
    inv->bus_v = supply_bus_v(&inv->supply, &inv->p, end);
}

static void compare(struct step *st, sim_ps from, sim_ps to)
{
    struct inverter *inv = st->inv;
    struct bridge_load end = load_of(inv, st->i_a);
    double i_a[COMPARATORS] = {st->i_a[0], st->i_a[1], st->i_a[2], total_a(&end, inv->bus_v)};
    sim_ps beyond_at[COMPARATORS];
    for (int k = 0; k < COMPARATORS; k++) {
        double start_a = k == COMPARATOR_BUS ? total_a(&st->load, inv->bus_v) : st->i_start_a[k];
        beyond_at[k] = fabs(start_a) > inv->p.oc_trip_a ? from : to;
    }
    comparators_follow(inv, i_a, beyond_at, to);
}

/* Settles the legs and fills in what holds at the start. */
static void begin(struct step *st, struct motor *motor)
{
    double i_motor_a[3];
    circuit_build_now(st->inv, &st->circuit);
    if (diodes_any_off(st->inv)) {
        diodes_settle(st->inv, motor, &st->circuit);
    }
    terminals_currents(st->inv, motor, i_motor_a);
    circuit_leg_currents(st->inv, &st->circuit, i_motor_a, st->i_start_a);
    memcpy(st->inv->leg_a, st->i_start_a, sizeof st->i_start_a);
    st->load = load_of(st->inv, st->i_start_a);
    st->watch = watch_for(st->inv, st->i_start_a);
    st->margin_start_a = event_margin(st->inv, &st->watch, st->i_start_a);
}

/* One step of at most left_s, which ends at `to` if it is not cut short; returns its length. */
static double advance_step(struct inverter *inv, struct motor *motor, double left_s, sim_ps to)
{
    struct step st;
    st.inv = inv;
    st.before = motor;
    begin(&st, motor);
    double dt_s = fmin(left_s, longest_step_s(&st));
    prepare(&st, dt_s);
    try_step(&st, dt_s);
    double part = coss_swings(inv) ? coss_part_to_rail(inv, st.i_start_a, st.i_a, dt_s) : 1;
    if (part < 1) {
        dt_s *= part;
        try_length(&st, dt_s);
    }
    if (inv->short_from < 0 && st.margin_start_a > 0 && st.margin_a < -DIODE_ZERO_A) {
        dt_s = locate_event(&st, dt_s);
    }
    account(&st, coss_move(inv, st.i_start_a, st.i_a, dt_s), dt_s);
    *motor = st.after;
    compare(&st, to - sim_from_s(left_s), to - sim_from_s(left_s - dt_s));
    if (inv->on_step) {
        inv->on_step(inv->on_step_context, dt_s, st.i_start_a, st.i_a);
    }
    return dt_s;
}

/* Steps up to `to`, or to an instant at which the comparators change their output or have set themselves another; returns
 * the time that is left. */
static double advance_steps(struct inverter *inv, struct motor *motor, double left_s, sim_ps to)
{
    bool was_active = inv->overcurrent;
    while (left_s > 0.5e-12) {
        left_s -= advance_step(inv, motor, left_s, to);
        if ((inv->overcurrent && !was_active) || comparators_next(inv) < to) {
            return left_s;
        }
        was_active = inv->overcurrent;
    }
    return 0;
}

sim_ps inverter_advance(struct inverter *inv, struct motor *motor, sim_ps from, sim_ps to)
{
    bool was_active = inv->overcurrent;
    for (sim_ps now = from; now < to;) {
        sim_ps due = comparators_next(inv), until = due > now && due < to ? due : to;
        double left_s = advance_steps(inv, motor, sim_to_s(until - now), until);
        now = until - sim_from_s(left_s);
        if (inv->overcurrent && !was_active) {
            return now;
        }
        was_active = inv->overcurrent;
    }
    return to;
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Between two changes of a leg the circuit is linear (circuit.h) and the motor integrates it. A leg changes when a
 * switch does, when the current of a conducting diode reaches zero (found by secant steps, to a microampere), when a
 * swinging node or a floating terminal reaches a rail (settled before every step). Comparators trip at the instant they
 * are found to. */
#include <math.h>
#include <string.h>

#include "account.h"
#include "coss.h"
#include "diodes.h"
#include "extremes.h"
#include "terminals.h"

#define LONGEST_STEP_S 10e-6
#define SWING_ZERO_A   1e-4 /* a diode that hands over to a swing need not end as exactly as one that blocks */

/* ---- one step, and the instants inside it ---- */

static void begin_watch(const struct inverter *inv, const double i_start_a[3], struct watch *w)
{
    for (int k = 0; k < 3; k++) {
        w->diode[k] = (inv->leg[k] == LEG_DIODE_LO && i_start_a[k] > DIODE_ZERO_A) ||
                      (inv->leg[k] == LEG_DIODE_HI && i_start_a[k] < -DIODE_ZERO_A);
        w->level[k] = !inv->comparators.tripped && !comparators_beyond(inv, k);
    }
}

/* Distance to the first of those events: negative once one is past. */
static double event_margin(const struct inverter *inv, const struct watch *w, const double i_a[3])
{
    double margin_a = INFINITY;
    for (int k = 0; k < 3; k++) {
        if (w->diode[k]) {
            margin_a = lesser(margin_a, inv->leg[k] == LEG_DIODE_LO ? i_a[k] : -i_a[k]);
        }
        if (w->level[k]) {
            margin_a = lesser(margin_a, inv->p.oc_trip_a - fabs(i_a[k]));
        }
    }
    return margin_a;
}

static void try_step(struct step *st, double dt_s)
{
    double i_motor_a[3];
    terminals_step(st->inv, st->motor, &st->circuit.source, dt_s);
    terminals_currents(st->inv, st->motor, i_motor_a);
    circuit_leg_currents(st->inv, &st->circuit, i_motor_a, st->i_a);
    st->margin_a = event_margin(st->inv, &st->watch, st->i_a);
}

/* The bus of the middle of the step serves for all of it: second order, like the mean of the drawn current. */
static void prepare(struct step *st, double dt_s)
{
    st->bus = supply_view(&st->inv->supply, &st->inv->p, st->load, dt_s);
    circuit_build(st->inv, &st->bus, dt_s, &st->circuit);
}

/* Whether another length of the step is another circuit. A plain bus moves too little for that. */
static bool depends_on_length(const struct inverter *inv)
{
    return !inv->supply.plain || coss_swings(inv);
}

/* Again, with another length. */
static void try_length(struct step *st, double dt_s)
{
    motor_put_back(st->motor, &st->start);
    if (depends_on_length(st->inv)) {
        prepare(st, dt_s);
    }
    try_step(st, dt_s);
}

static double zero_a(const struct inverter *inv)
{
    return inv->node_f > 0 ? SWING_ZERO_A : DIODE_ZERO_A;
}

/* Shortens a step that overshot so that it ends just past the event (regula falsi, Illinois variant). */
static double locate_event(struct step *st, double dt_s)
{
    const double past_a = zero_a(st->inv) / 2; /* aim beyond zero, so that the event has surely happened */
    double t0 = 0, f0 = st->margin_start_a + past_a, t1 = dt_s, f1 = st->margin_a + past_a;
    for (int n = 0; n < 60 && fabs(f1) > past_a * 0.99; n++) {
        double t = t0 + (t1 - t0) * f0 / (f0 - f1);
        if (!(t < 2 * dt_s)) { /* it has hardly begun, and hardly passed: where it would be surely past is anywhere */
            break;
        }
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
    double inductance_h = terminals_inductance_h(st->motor);
    double dt_s = lesser(LONGEST_STEP_S, motor_max_step_s(st->motor, circuit_largest_ohm(inv)));
    dt_s = lesser(dt_s, 0.1 * sqrt(inductance_h * inv->p.bus_capacitance_f));
    dt_s = lesser(dt_s, inv->supply.longest_step_s);
    if (inv->short_from >= 0) {
        dt_s = lesser(dt_s, LONGEST_JOINED_STEP_S);
    }
    for (int k = 0; k < 3; k++) {
        if (inv->leg[k] == LEG_BOTH) {
            dt_s = lesser(dt_s, larger(0.1 * inv->p.r_on_ohm * inv->p.bus_capacitance_f, 1e-9));
        }
    }
    return coss_swings(inv) ? lesser(dt_s, coss_longest_step_s(inv, st->motor, st->i_start_a)) : dt_s;
}

static void compare(struct step *st, const struct bridge_load *end, sim_ps from, sim_ps to)
{
    struct inverter *inv = st->inv;
    double i_a[COMPARATORS] = {st->i_a[0], st->i_a[1], st->i_a[2], step_bus_a(end, inv->bus_v)};
    if (comparators_idle(inv, i_a)) {
        return;
    }
    sim_ps beyond_at[COMPARATORS];
    for (int k = 0; k < COMPARATORS; k++) {
        double start_a = k == COMPARATOR_BUS ? step_bus_a(&st->load, inv->bus_v) : st->i_start_a[k];
        beyond_at[k] = fabs(start_a) > inv->p.oc_trip_a ? from : to;
    }
    comparators_follow(inv, i_a, beyond_at, to);
}

/* Settles the legs and fills in what holds at the start. */
static void begin(struct step *st, struct motor *motor)
{
    struct inverter *inv = st->inv;
    if (diodes_any_off(inv)) {
        diodes_settle(inv, motor);
    }
    inverter_leg_currents(inv, motor, st->i_start_a);
    memcpy(inv->leg_a, st->i_start_a, sizeof st->i_start_a);
    st->load = step_load(inv, st->i_start_a);
    begin_watch(inv, st->i_start_a, &st->watch);
    st->margin_start_a = event_margin(inv, &st->watch, st->i_start_a);
}

/* One step of at most left_s, which ends at `to` if it is not cut short; returns its length. */
static double advance_step(struct inverter *inv, struct motor *motor, double left_s, sim_ps to)
{
    struct step st;
    st.inv = inv;
    st.motor = motor;
    begin(&st, motor);
    double dt_s = lesser(left_s, longest_step_s(&st));
    motor_keep(motor, &st.start);
    st.start_in_j = motor->energy_in_j;
    prepare(&st, dt_s);
    try_step(&st, dt_s);
    double part = coss_swings(inv) ? coss_part_to_rail(inv, st.i_start_a, st.i_a, dt_s) : 1;
    if (part < 1) {
        dt_s *= part;
        try_length(&st, dt_s);
    }
    if (inv->short_from < 0 && st.margin_start_a > 0 && st.margin_a < -zero_a(inv)) {
        dt_s = locate_event(&st, dt_s);
    }
    struct bridge_load end = account_step(&st, coss_move(inv, st.i_start_a, st.i_a, dt_s), dt_s);
    memcpy(inv->leg_a, st.i_a, sizeof st.i_a);
    compare(&st, &end, to - sim_from_s(left_s), to - sim_from_s(left_s - dt_s));
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

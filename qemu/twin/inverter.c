/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Between two changes of a leg the circuit is linear (circuit.h) and the motor integrates it. A leg changes when a
 * switch does, when the current of a conducting diode reaches zero (found by secant steps, to a microampere), or when a
 * floating terminal reaches a rail (settled before every step). */
#include "inverter.h"

#include <math.h>
#include <string.h>

#include "bus.h"
#include "circuit.h"
#include "diodes.h"

#define LONGEST_STEP_S 10e-6

#define KEY(field, lo, hi, init) \
    { \
#field, offsetof(struct inverter_params, field), lo, hi, init \
    }
const struct config_key inverter_keys[] = {
    KEY(vbus_v, 0, 2000, CONFIG_REQUIRED),
    KEY(supply_resistance_ohm, 0, 1e3, 0.05),
    KEY(supply_sinks, 0, 1, 1),
    KEY(bus_capacitance_f, 1e-7, 10, 470e-6),
    KEY(r_on_ohm, 1e-5, 10, 0.005),
    KEY(diode_v, 0, 5, 0.8),
    KEY(turn_on_delay_s, 0, 1e-5, 0),
    KEY(turn_off_delay_s, 0, 1e-5, 0),
    KEY(oc_trip_a, 1e-3, 1e5, CONFIG_REQUIRED),
    CONFIG_KEYS_END,
};
#undef KEY

void inverter_init(struct inverter *inv, const struct inverter_params *p)
{
    memset(inv, 0, sizeof *inv);
    inv->p = *p;
    inv->bus_v = p->vbus_v;
    inv->short_from = -1;
    for (int n = 0; n < 6; n++) {
        inv->switch_at[n] = SIM_NEVER;
    }
    for (int k = 0; k < 3; k++) {
        inv->leg[k] = LEG_BLOCKED;
    }
}

/* ---- switches ---- */

void inverter_command(struct inverter *inv, unsigned gates, sim_ps now)
{
    for (int n = 0; n < 6; n++) {
        bool on = (gates >> n) & 1;
        if (on == ((inv->gates >> n) & 1)) {
            continue;
        }
        /* A gate that returns before the switch has followed cancels the change: too short a pulse does nothing. */
        bool conducts = (inv->conduct >> n) & 1;
        double delay_s = on ? inv->p.turn_on_delay_s : inv->p.turn_off_delay_s;
        inv->switch_at[n] = on == conducts ? SIM_NEVER : now + sim_from_s(delay_s);
    }
    inv->gates = gates;
}

sim_ps inverter_next_switch(const struct inverter *inv)
{
    sim_ps next = SIM_NEVER;
    for (int n = 0; n < 6; n++) {
        next = inv->switch_at[n] < next ? inv->switch_at[n] : next;
    }
    return next;
}

static void follow_switches(struct inverter *inv, int k)
{
    bool high = inv->conduct & GATE_HIGH(k);
    bool low = inv->conduct & GATE_LOW(k);
    if (high || low) {
        inv->leg[k] = high && low ? LEG_BOTH : (high ? LEG_HIGH : LEG_LOW);
    } else if (inv->leg[k] < LEG_JUST_OFF) {
        inv->leg[k] = LEG_JUST_OFF;
    }
}

void inverter_switch(struct inverter *inv, sim_ps now)
{
    for (int n = 0; n < 6; n++) {
        if (inv->switch_at[n] <= now) {
            inv->switch_at[n] = SIM_NEVER;
            inv->conduct ^= 1u << n;
            follow_switches(inv, n / 2);
        }
    }
}

/* ---- one step, and the instants inside it ---- */

/* Current that the bridge draws from the bus. */
static double bridge_current(const struct inverter *inv, const double i_a[3])
{
    double sum_a = 0;
    for (int k = 0; k < 3; k++) {
        if (inv->leg[k] == LEG_HIGH || inv->leg[k] == LEG_DIODE_HI) {
            sum_a += i_a[k];
        } else if (inv->leg[k] == LEG_BOTH) {
            sum_a += i_a[k] / 2 + inv->bus_v / (2 * inv->p.r_on_ohm);
        }
    }
    return sum_a;
}

static bool comparators(const struct inverter *inv, const double i_a[3])
{
    double worst_a = fmax(fmax(fabs(i_a[0]), fabs(i_a[1])), fabs(i_a[2]));
    return fmax(worst_a, fabs(bridge_current(inv, i_a))) > inv->p.oc_trip_a;
}

/* The events to be located in a step: diodes whose current may end, and the comparators. */
struct watch {
    bool diode[3];
    bool trip;
};

static struct watch watch_for(const struct inverter *inv, const double i_start_a[3])
{
    struct watch w = {.trip = !inv->overcurrent};
    for (int k = 0; k < 3; k++) {
        w.diode[k] = (inv->leg[k] == LEG_DIODE_LO && i_start_a[k] > DIODE_ZERO_A) ||
                     (inv->leg[k] == LEG_DIODE_HI && i_start_a[k] < -DIODE_ZERO_A);
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
        if (w->trip) {
            margin_a = fmin(margin_a, inv->p.oc_trip_a - fabs(i_a[k]));
        }
    }
    return margin_a;
}

static struct bus bus_of(const struct inverter *inv)
{
    return (struct bus){inv->p.vbus_v, inv->p.supply_resistance_ohm, inv->p.bus_capacitance_f,
                        inv->p.supply_sinks != 0};
}

struct step {
    struct inverter *inv;
    const struct motor *before;
    const struct circuit *circuit;
    struct watch watch;
    struct motor after;
    double i_a[3];   /* leg currents at the end */
    double margin_a; /* at the end */
};

static void try_step(struct step *st, double dt_s)
{
    double i_motor_a[3];
    st->after = *st->before;
    motor_step(&st->after, &st->circuit->source, dt_s);
    motor_currents(&st->after, i_motor_a);
    circuit_leg_currents(st->inv, st->circuit, i_motor_a, st->i_a);
    st->margin_a = event_margin(st->inv, &st->watch, st->i_a);
}

/* Shortens a step that overshot so that it ends just past the event (regula falsi, Illinois variant). */
static double locate_event(struct step *st, double dt_s, double margin_start_a)
{
    const double past_a = DIODE_ZERO_A / 2; /* aim beyond zero, so that the event has surely happened */
    double t0 = 0, f0 = margin_start_a + past_a, t1 = dt_s, f1 = st->margin_a + past_a;
    for (int n = 0; n < 60 && fabs(f1) > past_a * 0.99; n++) {
        double t = t0 + (t1 - t0) * f0 / (f0 - f1);
        try_step(st, t);
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
    try_step(st, t1);
    return t1;
}

static double longest_step_s(const struct inverter *inv, const struct motor *motor, const struct circuit *c)
{
    double dt_s = fmin(LONGEST_STEP_S, motor_max_step_s(motor, c->r_max_ohm));
    double ringing_s = sqrt(motor_min_inductance_h(motor) * inv->p.bus_capacitance_f);
    dt_s = fmin(dt_s, 0.1 * ringing_s);
    if (inv->short_from >= 0) {
        dt_s = fmin(dt_s, LONGEST_JOINED_STEP_S);
    }
    for (int k = 0; k < 3; k++) {
        if (inv->leg[k] == LEG_BOTH) {
            dt_s = fmin(dt_s, fmax(0.1 * inv->p.r_on_ohm * inv->p.bus_capacitance_f, 1e-9));
        }
    }
    return dt_s;
}

/* One step of at most dt_s; returns its length. */
static double advance_step(struct inverter *inv, struct motor *motor, double dt_s)
{
    struct circuit c;
    circuit_build(inv, &c);
    if (diodes_any_off(inv)) {
        diodes_settle(inv, motor, &c);
    }
    double i_motor_a[3], i_start_a[3];
    motor_currents(motor, i_motor_a);
    circuit_leg_currents(inv, &c, i_motor_a, i_start_a);
    double drawn_a = bridge_current(inv, i_start_a);
    dt_s = fmin(dt_s, longest_step_s(inv, motor, &c));

    /* The bus of the middle of the step serves for all of it: second order, like the mean of the drawn current. */
    struct bus bus = bus_of(inv);
    double start_v = inv->bus_v;
    inv->bus_v = bus_voltage_after(&bus, start_v, drawn_a, dt_s / 2);
    circuit_build(inv, &c);

    struct step st = {.inv = inv, .before = motor, .circuit = &c, .watch = watch_for(inv, i_start_a)};
    double margin_a = event_margin(inv, &st.watch, i_start_a);
    try_step(&st, dt_s);
    if (inv->short_from < 0 && margin_a > 0 && st.margin_a < -DIODE_ZERO_A) {
        dt_s = locate_event(&st, dt_s, margin_a);
    }
    *motor = st.after;

    drawn_a = (drawn_a + bridge_current(inv, st.i_a)) / 2;
    double middle_v = inv->bus_v;
    inv->bus_v = bus_voltage_after(&bus, start_v, drawn_a, dt_s);
    double charge_as = drawn_a * dt_s + inv->p.bus_capacitance_f * (inv->bus_v - start_v);
    inv->energy_supply_j += inv->p.vbus_v * charge_as;
    inv->energy_bridge_j += middle_v * drawn_a * dt_s;
    inv->overcurrent = comparators(inv, st.i_a);
    if (inv->on_step) {
        inv->on_step(inv->on_step_context, dt_s, i_start_a, st.i_a);
    }
    return dt_s;
}

sim_ps inverter_advance(struct inverter *inv, struct motor *motor, sim_ps from, sim_ps to)
{
    bool was_tripped = inv->overcurrent;
    double left_s = sim_to_s(to - from);
    while (left_s > 0.5e-12) {
        left_s -= advance_step(inv, motor, left_s);
        if (inv->overcurrent && !was_tripped) {
            sim_ps tripped_at = to - sim_from_s(left_s);
            return tripped_at < to ? tripped_at : to;
        }
        was_tripped = inv->overcurrent;
    }
    return to;
}

void inverter_leg_currents(const struct inverter *inv, const struct motor *motor, double i_a[3])
{
    double i_motor_a[3];
    motor_currents(motor, i_motor_a);
    struct circuit c;
    circuit_build(inv, &c);
    circuit_leg_currents(inv, &c, i_motor_a, i_a);
}

/* ---- faults of the wiring ---- */

/* Off legs look for their diodes anew when the wiring changes. */
static void rewire(struct inverter *inv)
{
    for (int k = 0; k < 3; k++) {
        if (inv->leg[k] >= LEG_JUST_OFF) {
            inv->leg[k] = LEG_JUST_OFF;
        }
    }
}

void inverter_short(struct inverter *inv, int from, int to, double r_ohm)
{
    rewire(inv);
    inv->short_from = from;
    inv->short_to = to;
    inv->short_ohm = r_ohm;
}

void inverter_short_off(struct inverter *inv)
{
    rewire(inv);
    inv->short_from = -1;
}

void inverter_open_wire(struct inverter *inv, int phase, bool open)
{
    inv->wire_open[phase] = open;
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Each leg is a source behind a resistance, or nothing:
 *
 *   high on   v = bus - R_on i            both off, i > 0   v = -V_diode
 *   low on    v =     - R_on i            both off, i < 0   v = bus + V_diode
 *   both on   v = bus/2 - R_on/2 i        both off, i = 0   floats while -V_diode < v < bus + V_diode
 *
 * A leg with both switches off is the only non-linear part. Its state changes at two kinds of instant: the current of a
 * conducting diode reaches zero (found by secant steps, to a microampere), or a floating terminal reaches a rail
 * (settled before every step). Between those instants the circuit is linear and the motor integrates it. */
#include "inverter.h"

#include <math.h>
#include <string.h>

#include "bus.h"

#define LONGEST_STEP_S 10e-6
#define SHORTED_STEP_S 0.5e-6 /* with two terminals joined, diodes are settled once a step and not located */
#define ZERO_A 1e-6           /* a current below this has ended */
#define RAIL_MARGIN_V 1e-6

#define KEY(field, lo, hi, init) { #field, offsetof(struct inverter_params, field), lo, hi, init }
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

/* The circuit as it is for one step: a source per terminal and what follows from it. */
struct circuit {
    struct motor_source source;
    double short_gain[3]; /* short current = short_emf_a + sum of short_gain[l] * motor current l */
    double short_emf_a;
    double r_max_ohm;
};

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

/* ---- the linear circuit of the present leg states ---- */

static bool floats(const struct inverter *inv, int k)
{
    return inv->leg[k] == LEG_BLOCKED || inv->leg[k] == LEG_JUST_OFF;
}

static void leg_source(const struct inverter *inv, int k, double *emf_v, double *r_ohm)
{
    switch (inv->leg[k]) {
    case LEG_HIGH:
        *emf_v = inv->bus_v;
        *r_ohm = inv->p.r_on_ohm;
        break;
    case LEG_LOW:
        *emf_v = 0;
        *r_ohm = inv->p.r_on_ohm;
        break;
    case LEG_BOTH:
        *emf_v = inv->bus_v / 2;
        *r_ohm = inv->p.r_on_ohm / 2;
        break;
    case LEG_DIODE_LO:
        *emf_v = -inv->p.diode_v;
        *r_ohm = 0;
        break;
    case LEG_DIODE_HI:
        *emf_v = inv->bus_v + inv->p.diode_v;
        *r_ohm = 0;
        break;
    default: /* nothing flows */
        *emf_v = 0;
        *r_ohm = 0;
        break;
    }
}

/* Two terminals joined by R: the current s from x to y follows from the two sources and the motor's currents. */
static void add_short(const struct inverter *inv, struct circuit *c)
{
    int x = inv->short_from, y = inv->short_to, other = 3 - x - y;
    bool float_x = floats(inv, x), float_y = floats(inv, y);
    struct motor_source *src = &c->source;
    double r_x = src->r_ohm[x][x], r_y = src->r_ohm[y][y], e_x = src->emf_v[x], e_y = src->emf_v[y];

    c->r_max_ohm = fmax(c->r_max_ohm, inv->short_ohm);
    if (!float_x && !float_y) {
        double loop_ohm = inv->short_ohm + r_x + r_y;
        c->short_emf_a = (e_x - e_y) / loop_ohm;
        c->short_gain[x] = -r_x / loop_ohm;
        c->short_gain[y] = r_y / loop_ohm;
        src->emf_v[x] = e_x - r_x * c->short_emf_a;
        src->emf_v[y] = e_y + r_y * c->short_emf_a;
        src->r_ohm[x][x] = r_x - r_x * r_x / loop_ohm;
        src->r_ohm[y][y] = r_y - r_y * r_y / loop_ohm;
        src->r_ohm[x][y] = src->r_ohm[y][x] = r_x * r_y / loop_ohm;
    } else if (!float_y) {
        c->short_gain[x] = -1;
        src->emf_v[x] = e_y;
        src->r_ohm[x][x] = r_y + inv->short_ohm;
        src->r_ohm[x][y] = src->r_ohm[y][x] = r_y;
    } else if (!float_x) {
        c->short_gain[y] = 1;
        src->emf_v[y] = e_x;
        src->r_ohm[y][y] = r_x + inv->short_ohm;
        src->r_ohm[y][x] = src->r_ohm[x][y] = r_x;
    } else {
        c->short_gain[x] = -1;
        src->r_ohm[x][x] = inv->short_ohm;
        src->held[other] = true; /* the joined pair floats, so nothing can return through the third wire */
    }
    src->held[x] = inv->wire_open[x];
    src->held[y] = inv->wire_open[y];
}

static void build_circuit(const struct inverter *inv, struct circuit *c)
{
    memset(c, 0, sizeof *c);
    for (int k = 0; k < 3; k++) {
        leg_source(inv, k, &c->source.emf_v[k], &c->source.r_ohm[k][k]);
        c->source.held[k] = floats(inv, k) || inv->wire_open[k];
        c->r_max_ohm = fmax(c->r_max_ohm, c->source.r_ohm[k][k]);
    }
    if (inv->short_from >= 0) {
        add_short(inv, c);
    }
}

static void leg_currents(const struct inverter *inv, const struct circuit *c, const double i_motor_a[3], double i_a[3])
{
    memcpy(i_a, i_motor_a, 3 * sizeof *i_a);
    if (inv->short_from >= 0) {
        double s = c->short_emf_a;
        for (int k = 0; k < 3; k++) {
            s += c->short_gain[k] * i_motor_a[k];
        }
        i_a[inv->short_from] += s;
        i_a[inv->short_to] -= s;
    }
}

void inverter_leg_currents(const struct inverter *inv, const struct motor *motor, double i_a[3])
{
    double i_motor_a[3];
    motor_currents(motor, i_motor_a);
    struct circuit c;
    build_circuit(inv, &c);
    leg_currents(inv, &c, i_motor_a, i_a);
}

/* ---- diodes ---- */

static bool is_off(const struct inverter *inv, int k)
{
    return inv->leg[k] >= LEG_JUST_OFF;
}

static bool any_leg_off(const struct inverter *inv)
{
    return is_off(inv, 0) || is_off(inv, 1) || is_off(inv, 2);
}

/* A leg that has just lost its switches: the diode that takes over the current. */
static enum leg_state take_over(double i_a)
{
    if (fabs(i_a) < ZERO_A) {
        return LEG_BLOCKED;
    }
    return i_a > 0 ? LEG_DIODE_LO : LEG_DIODE_HI;
}

static void settle_just_off(struct inverter *inv, const double i_motor_a[3])
{
    for (int k = 0; k < 3; k++) {
        if (inv->leg[k] == LEG_JUST_OFF) {
            inv->leg[k] = inv->wire_open[k] ? LEG_BLOCKED : take_over(i_motor_a[k]);
        }
    }
}

/* Ends the diodes whose current has ended. True if there was one. */
static bool settle_conducting(struct inverter *inv, const double i_a[3])
{
    bool changed = false;
    for (int k = 0; k < 3; k++) {
        if ((inv->leg[k] == LEG_DIODE_LO && i_a[k] < ZERO_A) || (inv->leg[k] == LEG_DIODE_HI && i_a[k] > -ZERO_A)) {
            inv->leg[k] = LEG_BLOCKED;
            changed = true;
        }
    }
    return changed;
}

/* Starts the diode of the floating terminal that is furthest outside the rails. True if there was one. */
static bool start_diode(struct inverter *inv, const struct motor *motor, const struct circuit *c, const double i_a[3])
{
    double star_v[3], neutral_v = 0;
    int reference = -1, top = -1, bottom = -1;
    motor_star_voltages(motor, &c->source, star_v);
    for (int k = 0; k < 3; k++) {
        if (inv->wire_open[k]) {
            continue;
        }
        top = top < 0 || star_v[k] > star_v[top] ? k : top;
        bottom = bottom < 0 || star_v[k] < star_v[bottom] ? k : bottom;
        if (!floats(inv, k)) {
            double emf_v, r_ohm;
            leg_source(inv, k, &emf_v, &r_ohm);
            reference = k;
            neutral_v = emf_v - r_ohm * i_a[k] - star_v[k];
        }
    }
    double high_v = inv->bus_v + inv->p.diode_v + RAIL_MARGIN_V, low_v = -inv->p.diode_v - RAIL_MARGIN_V;
    if (reference < 0) {
        /* Everything floats: current starts when the EMF between two terminals exceeds the bus. */
        if (top < 0 || star_v[top] - star_v[bottom] <= high_v - low_v) {
            return false;
        }
        inv->leg[top] = LEG_DIODE_HI;
        inv->leg[bottom] = LEG_DIODE_LO;
        return true;
    }
    int worst = -1;
    double worst_v = 0;
    for (int k = 0; k < 3; k++) {
        double v = neutral_v + star_v[k];
        double beyond_v = fmax(v - high_v, low_v - v);
        if (inv->leg[k] == LEG_BLOCKED && !inv->wire_open[k] && beyond_v > worst_v) {
            worst = k;
            worst_v = beyond_v;
        }
    }
    if (worst < 0) {
        return false;
    }
    inv->leg[worst] = neutral_v + star_v[worst] > high_v ? LEG_DIODE_HI : LEG_DIODE_LO;
    return true;
}

/* Brings the legs with both switches off into agreement with the motor's currents and voltages. */
static void settle_diodes(struct inverter *inv, struct motor *motor, struct circuit *c)
{
    double i_motor_a[3], i_a[3];
    motor_currents(motor, i_motor_a);
    settle_just_off(inv, i_motor_a);
    for (int round = 0; round < 6; round++) {
        build_circuit(inv, c);
        leg_currents(inv, c, i_motor_a, i_a);
        /* A diode started in an earlier round has no current yet, so only the first round ends diodes. */
        bool changed = round == 0 && settle_conducting(inv, i_a);
        if (changed) {
            build_circuit(inv, c);
        }
        for (int k = 0; k < 3; k++) {
            if (c->source.held[k]) {
                motor_hold_phase(motor, k);
            }
        }
        motor_currents(motor, i_motor_a);
        leg_currents(inv, c, i_motor_a, i_a);
        changed |= start_diode(inv, motor, c, i_a);
        if (!changed) {
            return;
        }
    }
    build_circuit(inv, c);
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
    struct watch w = { .trip = !inv->overcurrent };
    for (int k = 0; k < 3; k++) {
        w.diode[k] = (inv->leg[k] == LEG_DIODE_LO && i_start_a[k] > ZERO_A) ||
                     (inv->leg[k] == LEG_DIODE_HI && i_start_a[k] < -ZERO_A);
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
    return (struct bus){ inv->p.vbus_v, inv->p.supply_resistance_ohm, inv->p.bus_capacitance_f,
                         inv->p.supply_sinks != 0 };
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
    leg_currents(st->inv, st->circuit, i_motor_a, st->i_a);
    st->margin_a = event_margin(st->inv, &st->watch, st->i_a);
}

/* Shortens a step that overshot so that it ends just past the event (regula falsi, Illinois variant). */
static double locate_event(struct step *st, double dt_s, double margin_start_a)
{
    const double past_a = ZERO_A / 2; /* aim beyond zero, so that the event has surely happened */
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
    double ringing_s = sqrt(fmin(motor->p.ld_h, motor->p.lq_h) * inv->p.bus_capacitance_f);
    dt_s = fmin(dt_s, 0.1 * ringing_s);
    if (inv->short_from >= 0) {
        dt_s = fmin(dt_s, SHORTED_STEP_S);
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
    build_circuit(inv, &c);
    if (any_leg_off(inv)) {
        settle_diodes(inv, motor, &c);
    }
    double i_motor_a[3], i_start_a[3];
    motor_currents(motor, i_motor_a);
    leg_currents(inv, &c, i_motor_a, i_start_a);
    double drawn_a = bridge_current(inv, i_start_a);
    dt_s = fmin(dt_s, longest_step_s(inv, motor, &c));

    /* The bus of the middle of the step serves for all of it: second order, like the mean of the drawn current. */
    struct bus bus = bus_of(inv);
    double start_v = inv->bus_v;
    inv->bus_v = bus_voltage_after(&bus, start_v, drawn_a, dt_s / 2);
    build_circuit(inv, &c);

    struct step st = { .inv = inv, .before = motor, .circuit = &c, .watch = watch_for(inv, i_start_a) };
    double margin_a = event_margin(inv, &st.watch, i_start_a);
    try_step(&st, dt_s);
    if (inv->short_from < 0 && margin_a > 0 && st.margin_a < -ZERO_A) {
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

/* ---- faults of the wiring ---- */

void inverter_short(struct inverter *inv, int from, int to, double r_ohm)
{
    inv->short_from = from;
    inv->short_to = to;
    inv->short_ohm = r_ohm;
}

void inverter_short_off(struct inverter *inv)
{
    inv->short_from = -1;
}

void inverter_open_wire(struct inverter *inv, int phase, bool open)
{
    inv->wire_open[phase] = open;
}

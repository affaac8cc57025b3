/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A plain supply is solved in closed form. The others take one trapezoidal step in the means of their states, which
 * keeps the energy to rounding whatever the step: with h the length of the step and overbars for means,
 *
 *   L' (S - S0) = E - R' S - u        L' = 2 L / h    E, R': the source with its slow branch
 *   C' (v - v0) = S - i - g u         C' = 2 C / h    S the source's current, i and g the load's and the chopper's
 *   u = v + ESR (S - i - g u)
 *
 * where u, the bridge's voltage, comes out linear in i. */
#include "supply.h"

#include <math.h>
#include <string.h>

#include "bus.h"
#include "inverter.h"

#define SIXTH_TURN_RAD 1.0471975511965976 /* between two crossings of the mains' phases */
#define TWO_PI         6.283185307179586

/* Parts that a plain supply has none of. */
static bool is_plain(const struct inverter_params *p)
{
    return p->supply_inductance_h == 0 && p->supply_c2_f == 0 && p->rectifier_hz == 0 && p->bus_esr_ohm == 0 &&
           p->chopper_ohm == 0;
}

/* The trapezoidal rule stays quiet up to twice the shortest time constant. */
static double longest_step_s(const struct inverter_params *p)
{
    double c = p->bus_capacitance_f, r = p->supply_resistance_ohm + p->bus_esr_ohm, longest_s = INFINITY;
    if (p->supply_inductance_h > 0) {
        longest_s = fmin(2 * p->supply_inductance_h / (r + 1e-9), 0.2 * sqrt(p->supply_inductance_h * c));
    } else if (p->supply_resistance_ohm > 0) {
        longest_s = 2 * r * c;
    }
    if (p->chopper_ohm > 0) {
        longest_s = fmin(longest_s, 2 * (p->chopper_ohm + p->bus_esr_ohm) * c);
    }
    return longest_s;
}

void supply_init(struct supply *s, const struct inverter_params *p)
{
    memset(s, 0, sizeof *s);
    s->cap_v = p->vbus_v;
    s->chopper_enabled = p->chopper_ohm > 0;
    s->plain = is_plain(p);
    s->longest_step_s = s->plain ? INFINITY : longest_step_s(p);
}

/* ---- the plain supply ---- */

static struct bus plain_bus(const struct inverter_params *p)
{
    return (struct bus){p->vbus_v, p->supply_resistance_ohm, p->bus_capacitance_f, p->supply_sinks != 0};
}

static double plain_loss_w(const struct inverter_params *p, double v)
{
    double over_v = p->vbus_v - v;
    bool fed = p->supply_resistance_ohm > 0 && (p->supply_sinks != 0 || over_v > 0);
    return fed ? over_v * over_v / p->supply_resistance_ohm : 0;
}

static struct supply_flow plain_step(struct supply *s, const struct inverter_params *p, double drawn_a, double middle_v,
                                     double dt_s)
{
    struct bus bus = plain_bus(p);
    double start_v = s->cap_v;
    s->cap_v = bus_voltage_after(&bus, start_v, drawn_a, dt_s);
    double charge_as = drawn_a * dt_s + p->bus_capacitance_f * (s->cap_v - start_v);
    s->heat_j += dt_s / 6 * (plain_loss_w(p, start_v) + 4 * plain_loss_w(p, middle_v) + plain_loss_w(p, s->cap_v));
    return (struct supply_flow){middle_v, p->vbus_v * charge_as};
}

/* ---- any other ---- */

static bool sinks(const struct inverter_params *p)
{
    return p->supply_sinks != 0 && p->rectifier_hz == 0;
}

static double chopper_s(const struct supply *s, const struct inverter_params *p)
{
    return s->chopper_on ? 1 / p->chopper_ohm : 0;
}

/* Of the source, ahead of now. A rectifier follows the larger of the mains' line-to-line voltages. */
static double source_v(const struct supply *s, const struct inverter_params *p, double ahead_s)
{
    if (p->rectifier_hz == 0) {
        return p->vbus_v;
    }
    double rad = s->mains_rad + TWO_PI * p->rectifier_hz * ahead_s;
    return p->vbus_v * cos(rad - SIXTH_TURN_RAD * (rad < SIXTH_TURN_RAD ? 0.5 : 1.5));
}

/* Source, slow branch and inductance over a step: feed * inertia_ohm = drive_v - ohm * feed - u. */
struct feed {
    bool on;
    double source_v, drive_v, ohm, inertia_ohm;
    double slow_v, slow_ohm; /* mean on C2: slow_v + slow_ohm * feed */
};

static struct feed feed_over(const struct supply *s, const struct inverter_params *p, bool on, double dt_s)
{
    struct feed f = {.on = on, .source_v = source_v(s, p, dt_s / 2), .inertia_ohm = 2 * p->supply_inductance_h / dt_s};
    if (p->supply_c2_f > 0) {
        double half_per_f = dt_s / (2 * p->supply_c2_f), fading = 1 + half_per_f / p->supply_r2_ohm;
        f.slow_v = s->slow_v / fading;
        f.slow_ohm = half_per_f / fading;
    }
    f.drive_v = f.source_v - f.slow_v + f.inertia_ohm * s->feed_a;
    f.ohm = p->supply_resistance_ohm + f.slow_ohm + f.inertia_ohm;
    return f;
}

/* Capacitor and what is beside it: u = v + ohm * (feed - i). */
struct store {
    double v, ohm;
};

static struct store store_over(const struct supply *s, const struct inverter_params *p, double shunt_s, double dt_s)
{
    double z = p->bus_esr_ohm + dt_s / (2 * p->bus_capacitance_f), share = 1 / (1 + z * shunt_s);
    return (struct store){share * s->cap_v, share * z};
}

static struct bus_view view_of(const struct feed *f, const struct store *c)
{
    if (!f->on) {
        return (struct bus_view){c->v, c->ohm};
    }
    double total_ohm = f->ohm + c->ohm;
    return (struct bus_view){c->v + c->ohm * (f->drive_v - c->v) / total_ohm, c->ohm * f->ohm / total_ohm};
}

/* The source's current now; without inductance it follows from the voltages, negative if it would flow back. */
static double feed_now_a(const struct supply *s, const struct inverter_params *p, struct bridge_load load)
{
    if (p->supply_inductance_h > 0) {
        return s->feed_a;
    }
    struct store c = store_over(s, p, load.conductance_s + chopper_s(s, p), 0);
    double drive_v = source_v(s, p, 0) - s->slow_v;
    return (drive_v - c.v + c.ohm * load.current_a) / (p->supply_resistance_ohm + c.ohm);
}

static bool is_fed(const struct supply *s, const struct inverter_params *p, struct bridge_load load)
{
    if (sinks(p) || feed_now_a(s, p, load) > 0) {
        return true;
    }
    struct store c = store_over(s, p, load.conductance_s + chopper_s(s, p), 0);
    return p->supply_inductance_h > 0 && source_v(s, p, 0) - s->slow_v > c.v - c.ohm * load.current_a;
}

static void turn_mains(struct supply *s, const struct inverter_params *p, double dt_s)
{
    s->mains_rad += TWO_PI * p->rectifier_hz * dt_s;
    if (s->mains_rad >= SIXTH_TURN_RAD) {
        s->mains_rad -= SIXTH_TURN_RAD;
    }
}

/* One piece of a step, fed all the time or not at all. */
static struct supply_flow piece(struct supply *s, const struct inverter_params *p, struct bridge_load load, bool fed,
                                double dt_s)
{
    double brake_s = chopper_s(s, p);
    struct feed f = feed_over(s, p, fed, dt_s);
    struct store c = store_over(s, p, load.conductance_s + brake_s, dt_s);
    struct bus_view view = view_of(&f, &c);
    double bus_v = view.open_v - view.ohm * load.current_a;
    double feed_a = fed ? (f.drive_v - bus_v) / f.ohm : 0;
    double slow_v = f.slow_v + f.slow_ohm * feed_a;
    double cap_a = feed_a - load.current_a - (load.conductance_s + brake_s) * bus_v;

    s->heat_j += dt_s * (p->supply_resistance_ohm * feed_a * feed_a + p->bus_esr_ohm * cap_a * cap_a);
    if (p->supply_c2_f > 0) {
        s->heat_j += dt_s * slow_v * slow_v / p->supply_r2_ohm;
        s->slow_v = 2 * slow_v - s->slow_v;
    }
    s->chopper_j += dt_s * brake_s * bus_v * bus_v;
    s->cap_v += dt_s / p->bus_capacitance_f * cap_a;
    s->feed_a = fed && p->supply_inductance_h > 0 ? 2 * feed_a - s->feed_a : 0;
    turn_mains(s, p, dt_s);
    return (struct supply_flow){bus_v * dt_s, f.source_v * feed_a * dt_s};
}

/* Above the upper level on, below the lower off. */
static void switch_chopper(struct supply *s, const struct inverter_params *p, double bus_v)
{
    if (p->chopper_ohm > 0) {
        double level_v = s->chopper_on ? p->chopper_off_v : p->chopper_on_v;
        s->chopper_on = s->chopper_enabled && bus_v > level_v;
    }
}

/* Whatever is left of the current when the source lets go becomes heat in its diodes. */
static void let_go(struct supply *s, const struct inverter_params *p)
{
    s->heat_j += p->supply_inductance_h * s->feed_a * s->feed_a / 2;
    s->feed_a = 0;
}

/* Takes a step if the source feeds all of it. If not, returns how long it does. */
static double feed_through(struct supply *s, const struct inverter_params *p, struct bridge_load load, double dt_s,
                           struct supply_flow *flow)
{
    if (!is_fed(s, p, load)) {
        return 0;
    }
    struct supply end = *s;
    *flow = piece(&end, p, load, true, dt_s);
    double start_a = feed_now_a(s, p, load), end_a = sinks(p) ? 0 : feed_now_a(&end, p, load);
    if (end_a < 0) {
        return start_a > 0 ? dt_s * start_a / (start_a - end_a) : 0;
    }
    *s = end;
    return dt_s;
}

/* A supply that does not sink lets go when its current reaches zero; the step is cut there. */
static struct supply_flow any_step(struct supply *s, const struct inverter_params *p, struct bridge_load load,
                                   double dt_s)
{
    struct supply_flow flow = {0, 0};
    double fed_s = feed_through(s, p, load, dt_s, &flow), alone_s = dt_s - fed_s;
    if (alone_s > 0) {
        flow = fed_s > 0 ? piece(s, p, load, true, fed_s) : (struct supply_flow){0, 0};
        let_go(s, p);
        flow.bus_v += piece(s, p, load, false, alone_s).bus_v;
    }
    flow.bus_v /= dt_s;
    return flow;
}

/* ---- both ---- */

struct bus_view supply_middle(const struct supply *s, const struct inverter_params *p, struct bridge_load load,
                              double dt_s)
{
    if (s->plain) {
        struct bus bus = plain_bus(p);
        return (struct bus_view){bus_voltage_after(&bus, s->cap_v, load.current_a, dt_s / 2), 0};
    }
    struct feed f = feed_over(s, p, is_fed(s, p, load), dt_s);
    struct store c = store_over(s, p, load.conductance_s + chopper_s(s, p), dt_s);
    return view_of(&f, &c);
}

struct supply_flow supply_step(struct supply *s, const struct inverter_params *p, struct bridge_load load,
                               struct bus_view view, double dt_s)
{
    if (s->plain) {
        return plain_step(s, p, load.current_a, view.open_v, dt_s);
    }
    struct supply_flow flow = any_step(s, p, load, dt_s);
    switch_chopper(s, p, supply_bus_v(s, p, load));
    return flow;
}

double supply_bus_v(const struct supply *s, const struct inverter_params *p, struct bridge_load load)
{
    if (s->plain) {
        return s->cap_v;
    }
    struct store c = store_over(s, p, load.conductance_s + chopper_s(s, p), 0);
    double feed_a = feed_now_a(s, p, load);
    return c.v + c.ohm * ((sinks(p) ? feed_a : fmax(feed_a, 0)) - load.current_a);
}

double supply_take(struct supply *s, const struct inverter_params *p, double charge_as)
{
    if (s->plain && p->supply_resistance_ohm == 0 && s->cap_v <= p->vbus_v) {
        return p->vbus_v * charge_as; /* the source holds the bus and gives it itself */
    }
    s->cap_v -= charge_as / p->bus_capacitance_f;
    return 0;
}

double supply_stored_j(const struct supply *s, const struct inverter_params *p)
{
    return (p->bus_capacitance_f * s->cap_v * s->cap_v + p->supply_inductance_h * s->feed_a * s->feed_a +
            p->supply_c2_f * s->slow_v * s->slow_v) /
           2;
}

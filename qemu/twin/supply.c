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
#include "extremes.h"
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
        longest_s = lesser(2 * p->supply_inductance_h / (r + 1e-9), 0.2 * sqrt(p->supply_inductance_h * c));
    } else if (p->supply_resistance_ohm > 0) {
        longest_s = 2 * r * c;
    }
    if (p->chopper_ohm > 0) {
        longest_s = lesser(longest_s, 2 * (p->chopper_ohm + p->bus_esr_ohm) * c);
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

/* cos x for |x| <= pi/6 */
static double cos_within_sixth(double x)
{
    double xx = x * x;
    return 1 - xx / 2 * (1 - xx / 12 * (1 - xx / 30 * (1 - xx / 56 * (1 - xx / 90 * (1 - xx / 132)))));
}

/* Of the source, ahead of now. A rectifier follows the larger of the mains' line-to-line voltages. */
static double source_v(const struct supply *s, const struct inverter_params *p, double ahead_s)
{
    if (p->rectifier_hz == 0) {
        return p->vbus_v;
    }
    double rad = s->mains_rad + TWO_PI * p->rectifier_hz * ahead_s;
    return p->vbus_v * cos_within_sixth(rad - SIXTH_TURN_RAD * (rad < SIXTH_TURN_RAD ? 0.5 : 1.5));
}

/* Capacitor and what is beside it: u = v + ohm * (feed - i), in means over a step or, without a length, now. */
struct store {
    double v, ohm;
};

static struct store store_over(const struct supply *s, const struct inverter_params *p, double conductance_s,
                               double dt_s)
{
    double z = p->bus_esr_ohm + dt_s / (2 * p->bus_capacitance_f);
    double share = 1 / (1 + z * (conductance_s + chopper_s(s, p)));
    return (struct store){share * s->cap_v, share * z};
}

/* The source's current now; without inductance it follows from the voltages, negative if it would flow back. */
static double feed_now_a(const struct supply *s, const struct inverter_params *p, struct bridge_load load)
{
    if (p->supply_inductance_h > 0) {
        return s->feed_a;
    }
    struct store c = store_over(s, p, load.conductance_s, 0);
    double drive_v = source_v(s, p, 0) - s->slow_v;
    return (drive_v - c.v + c.ohm * load.current_a) / (p->supply_resistance_ohm + c.ohm);
}

static bool is_fed(const struct supply *s, const struct inverter_params *p, struct bridge_load load)
{
    if (sinks(p) || feed_now_a(s, p, load) > 0) {
        return true;
    }
    struct store c = store_over(s, p, load.conductance_s, 0);
    return p->supply_inductance_h > 0 && source_v(s, p, 0) - s->slow_v > c.v - c.ohm * load.current_a;
}

static struct bus_view view_over(const struct supply *s, const struct inverter_params *p, double conductance_s,
                                 bool fed, double dt_s)
{
    struct store c = store_over(s, p, conductance_s, dt_s);
    struct bus_view b = {.open_v = c.v, .ohm = c.ohm, .fed = fed, .slow_v = s->slow_v};
    double inertia_ohm = 2 * p->supply_inductance_h / dt_s;
    if (p->supply_c2_f > 0) {
        double half_per_f = dt_s / (2 * p->supply_c2_f), fading = 1 + half_per_f / p->supply_r2_ohm;
        b.slow_v = s->slow_v / fading;
        b.slow_ohm = half_per_f / fading;
    }
    if (fed) {
        b.source_v = source_v(s, p, dt_s / 2);
        b.drive_v = b.source_v - b.slow_v + inertia_ohm * s->feed_a;
        b.feed_ohm = p->supply_resistance_ohm + b.slow_ohm + inertia_ohm;
        double total_ohm = b.feed_ohm + c.ohm;
        b.open_v += c.ohm * (b.drive_v - c.v) / total_ohm;
        b.ohm = c.ohm * b.feed_ohm / total_ohm;
    }
    return b;
}

static void turn_mains(struct supply *s, const struct inverter_params *p, double dt_s)
{
    s->mains_rad += TWO_PI * p->rectifier_hz * dt_s;
    if (s->mains_rad >= SIXTH_TURN_RAD) {
        s->mains_rad -= SIXTH_TURN_RAD;
    }
}

/* One piece of a step, fed all the time or not at all. Adds to the flow the integral of the bus's voltage. */
static void take(struct supply *s, const struct inverter_params *p, struct bridge_load load, const struct bus_view *b,
                 double dt_s, struct supply_flow *flow)
{
    double brake_s = chopper_s(s, p), bus_v = b->open_v - b->ohm * load.current_a;
    double feed_a = b->fed ? (b->drive_v - bus_v) / b->feed_ohm : 0, slow_v = b->slow_v + b->slow_ohm * feed_a;
    double cap_a = feed_a - load.current_a - (load.conductance_s + brake_s) * bus_v;

    s->heat_j += dt_s * (p->supply_resistance_ohm * feed_a * feed_a + p->bus_esr_ohm * cap_a * cap_a);
    if (p->supply_c2_f > 0) {
        s->heat_j += dt_s * slow_v * slow_v / p->supply_r2_ohm;
        s->slow_v = 2 * slow_v - s->slow_v;
    }
    s->chopper_j += dt_s * brake_s * bus_v * bus_v;
    s->cap_v += dt_s / p->bus_capacitance_f * cap_a;
    s->feed_a = b->fed && p->supply_inductance_h > 0 ? 2 * feed_a - s->feed_a : 0;
    turn_mains(s, p, dt_s);
    flow->bus_v += bus_v * dt_s;
    flow->source_j += b->source_v * feed_a * dt_s;
}

/* Whatever is left of the current when the source lets go becomes heat in its diodes. */
static void let_go(struct supply *s, const struct inverter_params *p)
{
    s->heat_j += p->supply_inductance_h * s->feed_a * s->feed_a / 2;
    s->feed_a = 0;
}

/* Takes the part of a step in which the source feeds, which ends early if its current would turn round; returns the
 * time that is left. */
static double take_fed(struct supply *s, const struct inverter_params *p, struct bridge_load load,
                       const struct bus_view *b, double dt_s, struct supply_flow *flow)
{
    struct supply before = *s;
    take(s, p, load, b, dt_s, flow);
    double end_a = sinks(p) ? 0 : feed_now_a(s, p, load);
    if (end_a >= 0) {
        return 0;
    }
    double start_a = feed_now_a(&before, p, load), fed_s = start_a > 0 ? dt_s * start_a / (start_a - end_a) : 0;
    *s = before;
    *flow = (struct supply_flow){0, 0};
    if (fed_s > 0) {
        struct bus_view part = view_over(s, p, load.conductance_s, true, fed_s);
        take(s, p, load, &part, fed_s, flow);
    }
    return dt_s - fed_s;
}

/* One with levels of its own: above the upper level on, below the lower off. Any other does what the fabric asks. */
static void switch_chopper(struct supply *s, const struct inverter_params *p, double bus_v)
{
    if (p->chopper_ohm > 0) {
        double level_v = s->chopper_on ? p->chopper_off_v : p->chopper_on_v;
        bool wanted = p->chopper_on_v > 0 ? bus_v > level_v : s->chopper_asked;
        s->chopper_on = s->chopper_enabled && wanted;
    }
}

static struct supply_flow any_step(struct supply *s, const struct inverter_params *p, struct bridge_load load,
                                   const struct bus_view *view, double dt_s)
{
    struct supply_flow flow = {0, 0};
    double alone_s = view->fed ? take_fed(s, p, load, view, dt_s, &flow) : dt_s;
    if (alone_s > 0) {
        struct bus_view alone = view_over(s, p, load.conductance_s, false, alone_s);
        let_go(s, p);
        take(s, p, load, &alone, alone_s, &flow);
    }
    flow.bus_v /= dt_s;
    return flow;
}

/* ---- both ---- */

struct bus_view supply_view(const struct supply *s, const struct inverter_params *p, struct bridge_load load,
                            double dt_s)
{
    if (s->plain) {
        struct bus bus = plain_bus(p);
        return (struct bus_view){.open_v = bus_voltage_after(&bus, s->cap_v, load.current_a, dt_s / 2)};
    }
    return view_over(s, p, load.conductance_s, is_fed(s, p, load), dt_s);
}

struct supply_flow supply_step(struct supply *s, const struct inverter_params *p, struct bridge_load load,
                               const struct bus_view *view, double dt_s)
{
    if (s->plain) {
        return plain_step(s, p, load.current_a, view->open_v, dt_s);
    }
    struct supply_flow flow = any_step(s, p, load, view, dt_s);
    switch_chopper(s, p, supply_bus_v(s, p, load));
    return flow;
}

double supply_bus_v(const struct supply *s, const struct inverter_params *p, struct bridge_load load)
{
    if (s->plain) {
        return s->cap_v;
    }
    struct store c = store_over(s, p, load.conductance_s, 0);
    double feed_a = feed_now_a(s, p, load);
    return c.v + c.ohm * ((sinks(p) ? feed_a : larger(feed_a, 0)) - load.current_a);
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

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The supply and what stands on the bus, without a bridge: a load that steps, against an integration in steps of 5 ns, and
 * closed forms of each part. */
#include "supply.h"

#include <math.h>
#include <stdio.h>

#include "bench.h"
#include "check.h"

#define PI 3.141592653589793

static struct inverter_params stage(void)
{
    struct inverter_params p = bench_inverter;
    p.vbus_v = 300;
    p.supply_resistance_ohm = 0.3;
    p.bus_capacitance_f = 200e-6;
    return p;
}

static struct supply supply_of(const struct inverter_params *p)
{
    struct supply s;
    supply_init(&s, p);
    return s;
}

/* Advances as the bridge does, in steps of 2 us; returns the energy out of the source, adds that into the bridge. */
static double run(struct supply *s, const struct inverter_params *p, double load_a, double duration_s, double *bridge_j)
{
    const struct bridge_load load = {load_a, 0};
    double source_j = 0;
    for (long n = lround(duration_s / 2e-6); n > 0; n--) {
        struct bus_view view = supply_view(s, p, load, 2e-6);
        struct supply_flow flow = supply_step(s, p, load, &view, 2e-6);
        source_j += flow.source_j;
        *bridge_j += flow.bus_v * load_a * 2e-6;
    }
    return source_j;
}

static double bus_v(const struct supply *s, const struct inverter_params *p, double load_a)
{
    return supply_bus_v(s, p, (struct bridge_load){load_a, 0});
}

/* ---- the whole, in small steps ---- */

struct small {
    double v, feed_a, slow_v, t_s;
    bool chopper;
};

static double mains_v(const struct inverter_params *p, double t_s)
{
    if (p->rectifier_hz == 0) {
        return p->vbus_v;
    }
    double best_v = 0;
    for (int n = 0; n < 6; n++) { /* six line-to-line voltages; two of them cross at t = 0 */
        best_v = fmax(best_v, cos(2 * PI * p->rectifier_hz * t_s - PI / 6 - n * PI / 3));
    }
    return p->vbus_v * best_v;
}

static double small_bus_v(const struct small *x, const struct inverter_params *p, double load_a)
{
    double shunt_s = x->chopper ? 1 / p->chopper_ohm : 0;
    return (x->v + p->bus_esr_ohm * (x->feed_a - load_a)) / (1 + p->bus_esr_ohm * shunt_s);
}

static void small_step(struct small *x, const struct inverter_params *p, double load_a, double dt_s)
{
    double drive_v = mains_v(p, x->t_s) - x->slow_v, u = small_bus_v(x, p, load_a);
    bool one_way = p->rectifier_hz > 0 || p->supply_sinks == 0;
    if (p->supply_inductance_h > 0) {
        x->feed_a += dt_s / p->supply_inductance_h * (drive_v - p->supply_resistance_ohm * x->feed_a - u);
    } else {
        double shunt_s = x->chopper ? 1 / p->chopper_ohm : 0, esr = p->bus_esr_ohm / (1 + p->bus_esr_ohm * shunt_s);
        double open_v = x->v / (1 + p->bus_esr_ohm * shunt_s) - esr * load_a;
        x->feed_a = (drive_v - open_v) / (p->supply_resistance_ohm + esr);
    }
    x->feed_a = one_way ? fmax(x->feed_a, 0) : x->feed_a;
    u = small_bus_v(x, p, load_a);
    double chopper_a = x->chopper ? u / p->chopper_ohm : 0;
    x->v += dt_s / p->bus_capacitance_f * (x->feed_a - load_a - chopper_a);
    if (p->supply_c2_f > 0) {
        x->slow_v += dt_s / p->supply_c2_f * (x->feed_a - x->slow_v / p->supply_r2_ohm);
    }
    if (p->chopper_ohm > 0) {
        x->chopper = u > (x->chopper ? p->chopper_off_v : p->chopper_on_v);
    }
    x->t_s += dt_s;
}

/* Loads of up to 20 A both ways for 4 ms; the worst difference of the bus, and what the energies leave open. */
static void against_small_steps(const char *name, const struct inverter_params *p, double tolerance_v)
{
    struct supply s = supply_of(p);
    struct small x = {.v = p->vbus_v};
    double worst_v = 0, source_j = 0, bridge_j = 0, before_j = supply_stored_j(&s, p), lowest_v = INFINITY,
           highest_v = 0;
    char text[100];
    for (int n = 0; n < 40; n++) {
        double load_a = any_real(-8, 20);
        for (int k = 0; k < 20000; k++) {
            small_step(&x, p, load_a, 5e-9);
        }
        source_j += run(&s, p, load_a, 100e-6, &bridge_j);
        double v = bus_v(&s, p, load_a);
        worst_v = fmax(worst_v, fabs(v - small_bus_v(&x, p, load_a)));
        lowest_v = fmin(lowest_v, v);
        highest_v = fmax(highest_v, v);
    }
    snprintf(text, sizeof text, "%s: bus against steps of 5 ns, worst (V)", name);
    check_near(text, worst_v, 0, tolerance_v);
    snprintf(text, sizeof text, "%s: the bus moved by more than the tolerance (V)", name);
    check_true(text, highest_v - lowest_v > 20 * tolerance_v);
    double open_j = source_j + before_j - supply_stored_j(&s, p) - s.heat_j - s.chopper_j - bridge_j;
    snprintf(text, sizeof text, "%s: energy left open, of %g J", name, fabs(bridge_j));
    check_near(text, open_j, 0, 1e-5 * fabs(bridge_j));
    snprintf(text, sizeof text, "%s: heat (J)", name);
    check_between(text, s.heat_j, 1e-3, 10);
}

static void combinations(void)
{
    struct inverter_params p = stage();
    p.bus_esr_ohm = 0.1;
    against_small_steps("capacitor's resistance", &p, 0.02);
    p.supply_inductance_h = 50e-6;
    against_small_steps("and inductance", &p, 0.03);
    p.supply_r2_ohm = 0.5;
    p.supply_c2_f = 2e-3;
    against_small_steps("and a slow branch", &p, 0.03);
    p.supply_sinks = 0;
    against_small_steps("and no way back", &p, 0.2);
    p.chopper_ohm = 15;
    p.chopper_on_v = 305;
    p.chopper_off_v = 301;
    against_small_steps("and a chopper", &p, 0.3);
    p = stage();
    p.rectifier_hz = 50;
    against_small_steps("rectifier", &p, 0.1);
    p.supply_inductance_h = 2e-3;
    p.bus_esr_ohm = 0.05;
    against_small_steps("rectifier with a choke", &p, 0.3);
}

/* ---- each part alone ---- */

/* A load step shows at once by the capacitor's resistance beside the supply's. */
static void esr(void)
{
    struct inverter_params p = stage();
    p.bus_esr_ohm = 0.1;
    struct supply s = supply_of(&p);
    check_near("ESR: a step of 10 A (V)", bus_v(&s, &p, 0) - bus_v(&s, &p, 10), 10 * 0.1 * 0.3 / (0.1 + 0.3), 1e-9);
    p.supply_inductance_h = 10e-6;
    s = supply_of(&p);
    check_near("ESR: behind an inductance all of it (V)", bus_v(&s, &p, 0) - bus_v(&s, &p, 10), 10 * 0.1, 1e-9);
}

/* Underdamped L and C after a load step: the closed form. */
static void ringing(void)
{
    struct inverter_params p = stage();
    const double l = 100e-6, c = p.bus_capacitance_f, r = p.supply_resistance_ohm, i = 10;
    p.supply_inductance_h = l;
    struct supply s = supply_of(&p);
    double unused = 0, damping = r / (2 * l), w = sqrt(1 / (l * c) - damping * damping), worst_v = 0;
    for (int n = 1; n <= 100; n++) {
        run(&s, &p, i, 10e-6, &unused);
        /* v - 300 + r i = A e^-at cos wt + B e^-at sin wt, with v(0) = 300 and dv/dt(0) = -i/c */
        double t = n * 10e-6, b = (damping * r * i - i / c) / w;
        double v = 300 - r * i + exp(-damping * t) * (r * i * cos(w * t) + b * sin(w * t));
        worst_v = fmax(worst_v, fabs(bus_v(&s, &p, i) - v));
    }
    check_near("ringing of the supply's inductance, worst of 1 ms (V)", worst_v, 0, 2e-3);
}

static void battery(void)
{
    struct inverter_params p = stage();
    const double i = 20, r2 = 0.2, c2 = 0.05;
    p.supply_r2_ohm = r2;
    p.supply_c2_f = c2;
    struct supply s = supply_of(&p);
    double unused = 0;
    for (int n = 1; n <= 4; n++) {
        run(&s, &p, i, 5e-3, &unused);
        /* the capacitor's 60 us are over; the slow branch has 10 ms */
        double slow_v = i * r2 * (1 - exp(-n * 5e-3 / (r2 * c2)));
        check_near("battery: R at once, R2 slowly (V)", bus_v(&s, &p, i), 300 - i * 0.3 - slow_v, 0.05);
    }
}

/* Nothing drawn: the capacitor keeps the peak. A load of 1 A: it falls between the peaks, and mean and ripple are those of
 * the pulses, as the capacitor is too large to follow. With a load that holds it conducting: the pulses themselves. */
static void rectifier(void)
{
    struct inverter_params p = stage();
    p.rectifier_hz = 50;
    struct supply s = supply_of(&p);
    double unused = 0, low_v = INFINITY, high_v = 0, sum_v = 0;
    run(&s, &p, 0, 20e-3, &unused);
    check_near("rectifier, no load: the peak (V)", bus_v(&s, &p, 0), 300, 0.1);
    run(&s, &p, -5, 2e-3, &unused);
    check_near("rectifier: what comes back stays (V)", bus_v(&s, &p, 0), 300 + 5 * 2e-3 / 200e-6, 0.5);
    p.bus_capacitance_f = 1e-6;
    s = supply_of(&p);
    run(&s, &p, 30, 20e-3, &unused);
    for (int n = 0; n < 1000; n++) {
        run(&s, &p, 30, 20e-6, &unused);
        double v = bus_v(&s, &p, 30);
        low_v = fmin(low_v, v);
        high_v = fmax(high_v, v);
        sum_v += v;
    }
    check_near("rectifier, no capacitor to speak of: highest (V)", high_v, 300 - 30 * 0.3, 0.05);
    check_near("rectifier: lowest (V)", low_v, 300 * cos(PI / 6) - 30 * 0.3, 0.1);
    check_near("rectifier: mean (V)", sum_v / 1000, 300 * 3 / PI - 30 * 0.3, 0.05);
}

/* The motor brakes with 5 A into a bus that nobody relieves: up by i/C to the upper level, and down through the resistor to
 * the lower one, by the closed forms. */
static void chopper(void)
{
    struct inverter_params p = stage();
    const double i = 5, on_v = 380, off_v = 360, r = 40, c = p.bus_capacitance_f;
    p.supply_sinks = 0;
    p.chopper_ohm = r;
    p.chopper_on_v = on_v;
    p.chopper_off_v = off_v;
    struct supply s = supply_of(&p);
    double unused = 0, t_s[4], highest_v = 0;
    int changes = 0;
    for (long n = 0; changes < 4 && n < 100000; n++) {
        bool was_on = s.chopper_on;
        run(&s, &p, -i, 2e-6, &unused);
        highest_v = fmax(highest_v, bus_v(&s, &p, -i));
        if (s.chopper_on != was_on) {
            t_s[changes++] = (double)n * 2e-6;
        }
    }
    check_equal("chopper: on, off, on, off", changes, 4);
    check_near("chopper: on at (s)", t_s[0], (on_v - 300) * c / i, 5e-6);
    check_near("chopper: down in (s)", t_s[1] - t_s[0], r * c * log((on_v - r * i) / (off_v - r * i)), 5e-6);
    check_near("chopper: up in (s)", t_s[2] - t_s[1], (on_v - off_v) * c / i, 5e-6);
    check_near("chopper: highest (V)", highest_v, on_v, 0.1);
    double heat_j = s.chopper_j, returned_j = -unused;
    check_near("chopper: what came back is in it and in the capacitor (J)",
               heat_j + supply_stored_j(&s, &p) - 0.5 * c * 300 * 300, returned_j, 1e-6 * returned_j);
    s.chopper_enabled = false;
    run(&s, &p, -i, 4e-3, &unused);
    check_true("chopper disabled: the bus goes on up", bus_v(&s, &p, -i) > 450 && !s.chopper_on);
}

int main(void)
{
    combinations();
    esr();
    ringing();
    battery();
    rectifier();
    chopper();
    return check_end();
}

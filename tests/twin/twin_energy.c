/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Random switching, and random faults of the wiring: whatever happens, currents stay finite and sum to zero, and energy
 * is neither made nor lost. Nothing is known here of how the bridge works. */
#include <math.h>
#include <stdio.h>

#include "bench.h"
#include "check.h"

#define RUNS   60
#define PIECES 300

/* The worst of all runs. */
struct worst {
    bool finite;
    double sum_a, current_a;                  /* of the currents */
    double motor_j, bridge_j, bus_j, rotor_j; /* imbalances */
    double copper_j;                          /* for scale */
    double lost_j;                            /* the least */
};

/* Any combination but both switches of a leg. */
static unsigned any_gates(void)
{
    unsigned gates = 0;
    for (int k = 0; k < 3; k++) {
        gates |= (unsigned[]){0, GATE_HIGH(k), GATE_LOW(k), GATE_LOW(k)}[any_between(0, 3)];
    }
    return gates;
}

static void any_piece(struct bridge *s)
{
    bridge_gates(s, any_gates());
    bridge_advance(s, any_real(1e-9, 40e-6));
}

static void watch(const struct bridge *s, struct worst *w)
{
    double i_a[3], leg_a[3];
    motor_currents(&s->m, i_a);
    inverter_leg_currents(&s->inv, &s->m, leg_a);
    w->finite = w->finite && isfinite(i_a[0] + i_a[1] + i_a[2] + leg_a[0] + leg_a[1] + leg_a[2] + s->inv.bus_v);
    w->sum_a = fmax(w->sum_a, fabs(leg_a[0] + leg_a[1] + leg_a[2]));
    w->current_a = fmax(w->current_a, fmax(fabs(i_a[0]), fmax(fabs(i_a[1]), fabs(i_a[2]))));
}

/* Terminals = copper + air gap + magnetic field. */
static double motor_imbalance_j(const struct motor *m)
{
    return m->energy_in_j - m->energy_copper_j - m->energy_airgap_j - motor_magnetic_energy_j(m);
}

static void report(const char *which, const struct worst *w, double tolerance_j)
{
    char name[100];
    snprintf(name, sizeof name, "%s: finite", which);
    check_true(name, w->finite);
    snprintf(name, sizeof name, "%s: leg currents sum to zero (A)", which);
    check_near(name, w->sum_a, 0, 1e-9);
    snprintf(name, sizeof name, "%s: largest current (A)", which);
    check_between(name, w->current_a, 20, 300);
    snprintf(name, sizeof name, "%s: copper heat of a run (J)", which);
    check_between(name, w->copper_j, 0.2, 30);
    snprintf(name, sizeof name, "%s: terminals = copper + air gap + field (J)", which);
    check_near(name, w->motor_j, 0, tolerance_j);
}

static double kinetic_j(const struct motor *m)
{
    return 0.5 * m->p.inertia_kgm2 * m->speed_rad_s * m->speed_rad_s;
}

static double capacitor_j(const struct inverter *inv)
{
    return 0.5 * inv->p.bus_capacitance_f * inv->bus_v * inv->bus_v;
}

static struct bridge fresh(const struct inverter_params *p)
{
    struct bridge s = bridge_on_bench(p);
    s.m.speed_rad_s = any_real(-1000, 1000);
    return s;
}

/* Without resistance and diode drop nothing is lost between the capacitor and the motor's terminals, and with nothing
 * on the shaft all air-gap energy is in the rotor. */
static void lossless_bridge(void)
{
    struct inverter_params ip = bench_inverter;
    struct worst w = {.finite = true};
    ip.r_on_ohm = 0;
    ip.diode_v = 0;
    ip.supply_resistance_ohm = 1e6; /* next to nothing comes from the supply */
    for (int run = 0; run < RUNS; run++) {
        struct bridge s = fresh(&ip);
        double rotor_j = kinetic_j(&s.m), bus_j = capacitor_j(&s.inv);
        for (int n = 0; n < PIECES; n++) {
            any_piece(&s);
            watch(&s, &w);
        }
        w.motor_j = fmax(w.motor_j, fabs(motor_imbalance_j(&s.m)));
        w.bridge_j = fmax(w.bridge_j, fabs(s.inv.energy_bridge_j - s.m.energy_in_j));
        w.rotor_j = fmax(w.rotor_j, fabs(kinetic_j(&s.m) - rotor_j - s.m.energy_airgap_j));
        w.bus_j = fmax(w.bus_j, fabs(bus_j - capacitor_j(&s.inv) - s.inv.energy_bridge_j));
        w.copper_j = fmax(w.copper_j, s.m.energy_copper_j);
    }
    report("lossless bridge", &w, 1e-5);
    /* per run, of a turnover of some joules: what second-order steps of the bus leave */
    check_near("lossless bridge: bridge and terminals (J)", w.bridge_j, 0, 1e-3);
    check_near("lossless bridge: what left the capacitor (J)", w.bus_j, 0, 1e-3);
    check_near("lossless bridge: rotor and air gap (J)", w.rotor_j, 0, 1e-3);
}

/* Losses can only be losses: each stage passes on no more than it was given. */
static void lossy_bridge(bool sinks)
{
    struct inverter_params ip = bench_inverter;
    struct worst w = {.finite = true, .lost_j = INFINITY};
    ip.supply_sinks = sinks;
    for (int run = 0; run < RUNS; run++) {
        struct bridge s = fresh(&ip);
        double bus_j = capacitor_j(&s.inv);
        for (int n = 0; n < PIECES; n++) {
            any_piece(&s);
            watch(&s, &w);
        }
        double in_supply_j = s.inv.energy_supply_j + bus_j - capacitor_j(&s.inv) - s.inv.energy_bridge_j;
        double in_bridge_j = s.inv.energy_bridge_j - s.m.energy_in_j;
        w.lost_j = fmin(w.lost_j, fmin(in_supply_j, in_bridge_j));
        w.motor_j = fmax(w.motor_j, fabs(motor_imbalance_j(&s.m)));
        w.copper_j = fmax(w.copper_j, s.m.energy_copper_j);
    }
    report(sinks ? "supply that sinks" : "rectifier supply", &w, 1e-5);
    check_between("supply and bridge only lose (J)", w.lost_j, 0, 1);
}

static void any_fault(struct bridge *s)
{
    static const int pair[3][2] = {{0, 1}, {1, 2}, {2, 0}};
    int k = any_between(0, 2);
    switch (any_between(0, 40)) {
    case 0:
        inverter_short(&s->inv, pair[k][0], pair[k][1], any_real(0.01, 10));
        break;
    case 1:
        inverter_short_off(&s->inv);
        break;
    case 2:
        motor_spin(&s->m, any_real(-1000, 1000));
        break;
    case 3:
        motor_release(&s->m);
        break;
    default:
        break;
    }
}

/* Terminals shorted and not, shaft driven and not, both switches of a leg at times. */
static void faults(void)
{
    struct worst w = {.finite = true};
    for (int run = 0; run < RUNS; run++) {
        struct bridge s = fresh(&bench_inverter);
        for (int n = 0; n < PIECES; n++) {
            any_fault(&s);
            if (any_between(0, 100) == 0) {
                bridge_gates(&s, GATE_HIGH(0) | GATE_LOW(0));
                bridge_advance(&s, 1e-6);
            }
            any_piece(&s);
            watch(&s, &w);
        }
        w.motor_j = fmax(w.motor_j, fabs(motor_imbalance_j(&s.m)));
        w.copper_j = fmax(w.copper_j, s.m.energy_copper_j);
    }
    /* With a short, a diode ends at the end of a step: up to 40 mA (0.4 uJ of the field) cut off, hundreds of times. */
    report("shorts and shoot-through", &w, 1e-3);
}

/* A wire that breaks under current takes the field's energy with it (there is no arc), so only the flow is checked. */
static void open_wires(void)
{
    struct worst w = {.finite = true};
    double in_open_a = 0;
    for (int run = 0; run < RUNS; run++) {
        struct bridge s = fresh(&bench_inverter);
        for (int n = 0; n < PIECES; n++) {
            if (any_between(0, 40) == 0) {
                inverter_open_wire(&s.inv, any_between(0, 2), any_between(0, 1));
            }
            any_piece(&s);
            watch(&s, &w);
            double i_a[3];
            motor_currents(&s.m, i_a);
            for (int k = 0; k < 3; k++) {
                in_open_a = fmax(in_open_a, s.inv.wire_open[k] ? fabs(i_a[k]) : 0);
            }
        }
    }
    check_true("open wires: finite", w.finite);
    check_near("open wires: leg currents sum to zero (A)", w.sum_a, 0, 1e-9);
    check_near("open wires: carry nothing (A)", in_open_a, 0, 1e-6);
}

int main(void)
{
    lossless_bridge();
    lossy_bridge(true);
    lossy_bridge(false);
    faults();
    open_wires();
    return check_end();
}

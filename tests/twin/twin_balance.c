/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Energy with every effect of the power stage on, while the drive motors and brakes: what leaves the source is in the motor,
 * in heat, or stored. Each account is kept where it arises; nothing here is known of how. */
#include <math.h>
#include <stdio.h>

#include "bench.h"
#include "check.h"
#include "coss.h"

#define PI 3.141592653589793

/* Relative to what passed, both ways. */
#define OPEN_SHARE 1e-4

static struct inverter_params full(void)
{
    struct inverter_params p = bench_inverter;
    p.supply_resistance_ohm = 0.03;
    p.supply_inductance_h = 1e-6;
    p.supply_r2_ohm = 0.02;
    p.supply_c2_f = 1;
    p.bus_esr_ohm = 0.02;
    p.chopper_ohm = 4;
    p.chopper_on_v = 28;
    p.chopper_off_v = 26;
    p.switch_v = 0.1;
    p.diode_v = 0.12;
    p.diode_ohm = 0.01;
    p.switching_s = 60e-9;
    p.coss_c = 115e-9;
    p.turn_on_delay_s = 120e-9;
    p.turn_off_delay_s = 150e-9;
    p.oc_trip_a = 100;
    p.oc_blanking_s = 2e-6;
    return p;
}

struct sums {
    double supply_j, bridge_j; /* left open on either side of the bridge's terminals */
    double passed_j;           /* in steps of one period, whichever way */
    double edges_j, chopper_j, conduction_j, switching_j, braking_j;
};

static double supply_side_j(const struct inverter *inv)
{
    return inv->energy_supply_j - inv->supply.heat_j - inv->supply.chopper_j - inv->energy_bridge_j -
           supply_stored_j(&inv->supply, &inv->p);
}

static double bridge_side_j(const struct inverter *inv, const struct motor *m)
{
    return inv->energy_bridge_j - inv->energy_conduction_j - inv->energy_edges_j - inv->energy_switching_j -
           coss_stored_j(inv) - m->energy_in_j;
}

static void set_vector(struct plant *p, double share, double lead_rad)
{
    double rad = p->motor.p.pole_pairs * p->motor.theta_rad + lead_rad;
    for (int k = 0; k < 3; k++) {
        bench_leg(p, k, (uint32_t)lround(2500 + 2300 * share * cos(rad - k * 2 * PI / 3)));
    }
}

/* Spun at a speed whose EMF is half the bus, with a vector that drives, brakes or hardly does either. */
static struct sums drive(struct plant *p, double ld_h, const struct inverter_params *ip)
{
    struct plant_params params = bench_plant();
    struct sums s = {0};
    params.inverter = *ip;
    params.motor.ld_h = ld_h;
    params.motor.lq_h = 1.3 * ld_h;
    bench_start(p, &params, (uint32_t[3]){2500, 2500, 2500});
    motor_spin(&p->motor, 250);
    double supply_j = supply_side_j(&p->inverter), bridge_j = bridge_side_j(&p->inverter, &p->motor);
    for (int n = 0; n < 1000; n++) {
        double before_j = p->inverter.energy_bridge_j;
        set_vector(p, (n / 100) % 3 == 0 ? 0.85 : 0.62 - 0.2 * ((n / 100) % 3 == 2), PI / 2);
        bench_run(p, 50e-6);
        double period_j = p->inverter.energy_bridge_j - before_j;
        s.passed_j += fabs(period_j);
        s.braking_j += fmax(-period_j, 0);
    }
    s.supply_j = supply_side_j(&p->inverter) - supply_j;
    s.bridge_j = bridge_side_j(&p->inverter, &p->motor) - bridge_j;
    s.edges_j = p->inverter.energy_edges_j;
    s.conduction_j = p->inverter.energy_conduction_j;
    s.switching_j = p->inverter.energy_switching_j;
    s.chopper_j = p->inverter.supply.chopper_j;
    return s;
}

static void balance(const char *name, double ld_h, const struct inverter_params *ip)
{
    static struct plant p;
    struct sums s = drive(&p, ld_h, ip);
    char text[120];
    snprintf(text, sizeof text, "%s: supply side open, of %.3g J", name, s.passed_j);
    check_near(text, s.supply_j / s.passed_j, 0, OPEN_SHARE);
    snprintf(text, sizeof text, "%s: bridge side open, of %.3g J", name, s.passed_j);
    check_near(text, s.bridge_j / s.passed_j, 0, OPEN_SHARE);
    snprintf(text, sizeof text, "%s: heat of edges, conduction counts (share)", name);
    check_true(text, s.edges_j > 3 * OPEN_SHARE * s.passed_j && s.conduction_j > 100 * OPEN_SHARE * s.passed_j);
    snprintf(text, sizeof text, "%s: heat of switching counts where there is any", name);
    check_true(text, (s.switching_j > 10 * OPEN_SHARE * s.passed_j) == (ip->switching_s > 0));
    snprintf(text, sizeof text, "%s: it has braked", name);
    check_true(text, s.braking_j > 0.01 * s.passed_j);
}

/* ---- against the same in slices of 10 ns, in which every current is a straight line ---- */

static struct bridge spun(const struct inverter_params *ip, double ld_h)
{
    struct bridge b = bridge_on_bench(ip);
    struct motor_params p = bench_motor;
    p.ld_h = ld_h;
    p.lq_h = 1.3 * ld_h;
    motor_init(&b.m, &p, &bench_no_load);
    motor_spin(&b.m, 50);
    return b;
}

/* Both bridges switch alike; the second advances in slices. */
static void piece(struct bridge *whole, struct bridge *sliced, unsigned gates, double duration_s)
{
    const double slice_s = 10e-9;
    bridge_gates(whole, gates);
    bridge_gates(sliced, gates);
    bridge_advance(whole, duration_s);
    for (long n = lround(duration_s / slice_s); n > 0; n--) {
        bridge_advance(sliced, slice_s);
    }
}

static void against_slices(const char *name, double ld_h)
{
    struct inverter_params ip = full();
    ip.turn_on_delay_s = 0;
    ip.turn_off_delay_s = 0;
    struct bridge whole = spun(&ip, ld_h), sliced = whole;
    char text[100];
    for (int n = 0; n < 40; n++) {
        piece(&whole, &sliced, GATE_LOW(0) | GATE_HIGH(1) | GATE_LOW(2), 9e-6);
        piece(&whole, &sliced, GATE_LOW(0) | GATE_LOW(2), 1e-6);
        piece(&whole, &sliced, ALL_LOW, 9e-6);
        piece(&whole, &sliced, GATE_LOW(0) | GATE_LOW(2), 1e-6);
    }
    snprintf(text, sizeof text, "%s: out of the bus, as in slices (J)", name);
    check_near(text, whole.inv.energy_bridge_j, sliced.inv.energy_bridge_j, 3e-4 * sliced.inv.energy_bridge_j);
    snprintf(text, sizeof text, "%s: the bus, as in slices (V)", name);
    check_near(text, whole.inv.bus_v, sliced.inv.bus_v, 2e-3);
    snprintf(text, sizeof text, "%s: current of B, as in slices (A)", name);
    check_near(text, bridge_current(&whole, 1), bridge_current(&sliced, 1), 1e-3 * fabs(bridge_current(&sliced, 1)));
}

int main(void)
{
    struct inverter_params ip = full();
    against_slices("0.3 mH", 0.3e-3);
    against_slices("27 uH", 27e-6);
    balance("battery", 0.3e-3, &ip);
    balance("battery, small inductance", 27e-6, &ip);
    ip.rectifier_hz = 50;
    balance("rectifier with a chopper", 0.3e-3, &ip);
    balance("rectifier with a chopper, small inductance", 27e-6, &ip);
    ip.supply_inductance_h = 0;
    balance("rectifier without a choke", 0.3e-3, &ip);
    balance("rectifier without a choke, small inductance", 27e-6, &ip);
    ip = bench_inverter;
    ip.coss_c = 115e-9;
    balance("plain supply", 0.3e-3, &ip);
    return check_end();
}

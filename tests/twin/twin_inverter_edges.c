/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The output capacitance of a leg: what it does to the mean voltage, to the current of a small inductance, and to the
 * energy. Closed forms for a constant current; for a swing in which it changes, an integration in steps of 0.1 ns. */
#include <math.h>
#include <stdio.h>

#include "bench.h"
#include "check.h"
#include "coss.h"

#define BUS_V   24.0
#define QOSS_C  115e-9
#define DEAD_S  1e-6
#define CYCLE_S 50e-6

/* A bridge without drops, on a stiff supply. */
static struct bridge ideal_bridge(double coss_c, double inductance_h, double diode_v)
{
    struct inverter_params ip = bench_inverter;
    ip.coss_c = coss_c;
    ip.supply_resistance_ohm = 0;
    ip.r_on_ohm = 0;
    ip.diode_v = diode_v;
    struct bridge b = bridge_on_bench(&ip);
    struct motor_params p = bench_motor;
    p.ld_h = inductance_h;
    p.lq_h = inductance_h;
    p.resistance_ohm = 0;
    p.flux_wb = 0;
    motor_init(&b.m, &p, &bench_no_load);
    motor_lock(&b.m, true);
    return b;
}

#define BC_LOW (GATE_LOW(1) | GATE_LOW(2))

/* A cycle of leg A with dead times, B and C low. Returns the mean voltage of A against its ideal. */
static double cycle_error_v(struct bridge *b, double high_s)
{
    double before_vs = b->m.volt_alpha_vs;
    bridge_gates(b, BC_LOW | GATE_HIGH(0));
    bridge_advance(b, high_s);
    bridge_gates(b, BC_LOW);
    bridge_advance(b, DEAD_S);
    bridge_gates(b, BC_LOW | GATE_LOW(0));
    bridge_advance(b, CYCLE_S - high_s - 2 * DEAD_S);
    bridge_gates(b, BC_LOW);
    bridge_advance(b, DEAD_S);
    /* A against the star point is two thirds of A against B and C */
    return 1.5 * (b->m.volt_alpha_vs - before_vs) / CYCLE_S - BUS_V * (high_s + DEAD_S) / CYCLE_S;
}

/* The closed form: both switches swing, so twice Qoss moves. */
static double closed_form_v(double i_a)
{
    double full_v = BUS_V / CYCLE_S, corner_a = 2 * QOSS_C / DEAD_S;
    if (fabs(i_a) >= corner_a) {
        return -copysign(full_v * (DEAD_S - QOSS_C / fabs(i_a)), i_a);
    }
    return -full_v * DEAD_S * DEAD_S * i_a / (4 * QOSS_C);
}

static void voltage_error(void)
{
    static const double of_corner[] = {0.02, 0.1, 0.3, 0.7, 0.95, 1.05, 1.5, 3, 10, 60};
    const double full_v = BUS_V * DEAD_S / CYCLE_S, corner_a = 2 * QOSS_C / DEAD_S;
    for (int n = 0; n < 20; n++) {
        double i_a = of_corner[n / 2] * (n % 2 ? -corner_a : corner_a);
        struct bridge b = ideal_bridge(QOSS_C, 10, 0);
        char name[80];
        motor_set_current(&b.m, i_a, 0);
        cycle_error_v(&b, 20e-6);
        snprintf(name, sizeof name, "mean voltage error of a leg at %.3f A (V)", i_a);
        check_near(name, cycle_error_v(&b, 20e-6), closed_form_v(i_a), 1e-3 * full_v);
        b = ideal_bridge(0, 10, 0);
        motor_set_current(&b.m, i_a, 0);
        cycle_error_v(&b, 20e-6);
        check_near("without output charge: the full dead time (V)", cycle_error_v(&b, 20e-6), -copysign(full_v, i_a),
                   1e-9);
    }
}

/* No current in any leg, 4 cycles: every edge is hard and turns Qoss vbus into heat, supplied by the bus. */
static void hard_edges(void)
{
    const int edges = 8;
    struct bridge b = ideal_bridge(QOSS_C, 1000, 0);
    for (int n = 0; n < edges / 2; n++) {
        cycle_error_v(&b, 20e-6);
    }
    check_near("hard edges: heat (J)", b.inv.energy_edges_j, edges * QOSS_C * BUS_V, 0.01 * QOSS_C * BUS_V);
    check_near("hard edges: out of the supply (J)", b.inv.energy_supply_j, b.inv.energy_edges_j, 0.01 * QOSS_C * BUS_V);
    check_near("hard edges: no current comes of it (A)", bridge_current(&b, 0), 0, 1e-3);

    /* the same out of a capacitor that nothing feeds, and which loses 70 mV by it */
    struct inverter_params ip = bench_inverter;
    ip.coss_c = QOSS_C;
    ip.supply_resistance_ohm = 1e3;
    ip.bus_capacitance_f = 10e-6;
    struct bridge c = bridge_on_bench(&ip);
    bridge_gates(&c, ALL_LOW);
    double charge_as = -c.inv.bus_v * ip.bus_capacitance_f;
    bridge_gates(&c, GATE_HIGH(0) | GATE_HIGH(1) | GATE_HIGH(2));
    bridge_gates(&c, ALL_LOW);
    charge_as += c.inv.supply.cap_v * ip.bus_capacitance_f;
    check_near("hard edges: charge out of the capacitor (As)", -charge_as, 6 * QOSS_C, 5e-3 * 6 * QOSS_C);
}

/* Voltage and current together at the two hard edges that a leg has in a cycle, whichever way its current flows. */
static void switching(void)
{
    const double switching_s = 50e-9;
    static const double currents_a[] = {4, -4, 20, 0};
    for (int n = 0; n < 4; n++) {
        struct bridge b = ideal_bridge(0, 10, 0);
        b.inv.p.switching_s = switching_s;
        motor_set_current(&b.m, currents_a[n], 0);
        cycle_error_v(&b, 20e-6);
        double expected_j = 5 * BUS_V * fabs(currents_a[n]) * switching_s, out_j = b.inv.energy_bridge_j;
        double before_j = b.inv.energy_switching_j;
        double rest_j = -b.inv.energy_conduction_j - b.inv.energy_edges_j - b.m.energy_in_j;
        for (int cycle = 0; cycle < 5; cycle++) {
            cycle_error_v(&b, 20e-6);
        }
        check_near("switching: heat of five cycles (J)", b.inv.energy_switching_j - before_j, expected_j,
                   1e-3 * expected_j + 1e-9);
        rest_j += b.inv.energy_conduction_j + b.inv.energy_edges_j + b.m.energy_in_j;
        check_near("switching: it comes out of the bus (J)", b.inv.energy_bridge_j - out_j - rest_j, expected_j,
                   0.01 * expected_j + 1e-9);
    }
}

/* ---- a swing in which the current changes ---- */

/* Leg A lets go of i0 at the upper rail: L di/dt = 2/3 v, 2 C dv/dt = -i, diodes at the rails. */
struct swing {
    double i_a, v;
};

static struct swing integrate(double i0_a, double inductance_h, double diode_v, double duration_s)
{
    struct swing s = {i0_a, BUS_V};
    const double dt_s = 0.1e-9, node_f = 2 * QOSS_C / BUS_V;
    for (long n = lround(duration_s / dt_s); n > 0; n--) {
        double i_mid_a = s.i_a + dt_s / 2 * (2.0 / 3 * s.v / inductance_h);
        s.v = fmin(fmax(s.v - dt_s * i_mid_a / node_f, -diode_v), BUS_V + diode_v);
        s.i_a = i_mid_a + dt_s / 2 * (2.0 / 3 * s.v / inductance_h);
    }
    return s;
}

static void swing(const char *name, double i0_a, double inductance_h, double duration_s, double tolerance_v)
{
    const double diode_v = 0.8, node_f = 2 * QOSS_C / BUS_V, ring_ohm = sqrt(1.5 * inductance_h / node_f);
    struct bridge b = ideal_bridge(QOSS_C, inductance_h, diode_v);
    char text[100];
    bridge_gates(&b, BC_LOW | GATE_HIGH(0));
    motor_set_current(&b.m, i0_a, 0);
    b.inv.energy_edges_j = 0;
    bridge_gates(&b, BC_LOW);
    bridge_advance(&b, duration_s);
    struct swing s = integrate(i0_a, inductance_h, diode_v, duration_s);
    double v =
        b.inv.leg[0] == LEG_SWING ? b.inv.node[0].v : (b.inv.leg[0] == LEG_DIODE_LO ? -diode_v : BUS_V + diode_v);
    snprintf(text, sizeof text, "swing, %s: node (V)", name);
    check_near(text, v, s.v, tolerance_v);
    snprintf(text, sizeof text, "swing, %s: current (A)", name);
    check_near(text, bridge_current(&b, 0), s.i_a, tolerance_v / ring_ohm);
    snprintf(text, sizeof text, "swing, %s: it meets no switch, so no heat (J)", name);
    check_near(text, b.inv.energy_edges_j, 0, 1e-3 * QOSS_C * BUS_V);
}

static void swings(void)
{
    swing("large inductance, on its way", 0.2, 1e-3, 0.5e-6, 0.03);
    swing("large inductance, at the rail", 0.5, 1e-3, 0.9e-6, 0.03);
    /* 27 uH: a quarter of the ringing takes 0.98 us, and the bus changes the current by 0.6 A/us */
    swing("small inductance, the current grows", 0.05, 27e-6, 0.4e-6, 0.3);
    swing("small inductance, it turns round", -0.15, 27e-6, 0.6e-6, 0.5);
    swing("small inductance, into the lower diode", 0.2, 27e-6, 1.2e-6, 0.3);
}

/* Next to the rail, with hardly a current, but an EMF of 21 V that makes one: the step ends at the rail all the same. A node
 * beyond it would have to be brought back by the diode, as heat. */
static void caught_at_the_rail(void)
{
    struct inverter_params ip = bench_inverter;
    struct motor_params p = bench_motor;
    p.ld_h = p.lq_h = 27e-6;
    p.initial_angle_rad = 3.141592653589793 / 2 / p.pole_pairs;
    ip.coss_c = QOSS_C;
    struct bridge b = bridge_on_bench(&ip);
    motor_init(&b.m, &p, &bench_no_load);
    motor_spin(&b.m, 700);
    bridge_gates(&b, ALL_LOW);
    b.m.i_q_a = -0.001;
    bridge_gates(&b, BC_LOW);
    double edges_j = b.inv.energy_edges_j;
    bridge_advance(&b, 0.5e-6);
    check_equal("an EMF drives the node to the rail", b.inv.leg[0], LEG_DIODE_LO);
    check_near("and no further: no heat (J)", b.inv.energy_edges_j, edges_j, 1e-3 * QOSS_C * BUS_V);
}

/* All switches off with a current too small to reach a rail at once: the ringing, 4 us, ends after one of its periods and
 * costs nothing any more. */
static void comes_to_rest(void)
{
    struct inverter_params ip = bench_inverter;
    struct motor_params p = bench_motor;
    p.ld_h = p.lq_h = 27e-6;
    ip.coss_c = QOSS_C;
    struct bridge b = bridge_on_bench(&ip);
    motor_init(&b.m, &p, &bench_no_load);
    motor_lock(&b.m, true);
    bridge_gates(&b, A_HIGH_BC_LOW);
    motor_set_current(&b.m, 0.02, 0);
    bridge_gates(&b, 0);
    bridge_advance(&b, 8e-6);
    check_true("all off: every leg has come to rest",
               b.inv.leg[0] == LEG_BLOCKED && b.inv.leg[1] == LEG_BLOCKED && b.inv.leg[2] == LEG_BLOCKED);
    check_near("all off: no current (A)", hypot(b.m.i_d_a, b.m.i_q_a), 0, 1e-12);
    double v = b.inv.node[0].v;
    bridge_advance(&b, 1e-3);
    check_near("all off: the node stays (V)", b.inv.node[0].v, v, 0);
    motor_spin(&b.m, 1200); /* 62 V from line to line */
    bridge_advance(&b, 5e-3);
    check_true("all off: the diodes start all the same", hypot(b.m.i_d_a, b.m.i_q_a) > 1);
}

/* Half the current of a swing comes from the bus; all of the charge of a whole swing is Qoss. */
static void charge_of_a_swing(void)
{
    struct bridge b = ideal_bridge(QOSS_C, 10, 0);
    bridge_gates(&b, BC_LOW | GATE_HIGH(0));
    motor_set_current(&b.m, 2, 0);
    bridge_gates(&b, BC_LOW);
    double before_j = b.inv.energy_supply_j, edges_j = b.inv.energy_edges_j, stored_j = coss_stored_j(&b.inv),
           motor_j = b.m.energy_in_j;
    bridge_advance(&b, 1e-6);
    check_near("a whole swing: out of the supply (J)", b.inv.energy_supply_j - before_j, QOSS_C * BUS_V,
               0.01 * QOSS_C * BUS_V);
    check_near("a whole swing: into the motor (J)", b.m.energy_in_j - motor_j, QOSS_C * BUS_V, 0.01 * QOSS_C * BUS_V);
    check_near("a whole swing: as much stored as before (J)", coss_stored_j(&b.inv), stored_j, 1e-12);
    check_near("a whole swing: no heat (J)", b.inv.energy_edges_j, edges_j, 0.01 * QOSS_C * BUS_V);
}

int main(void)
{
    voltage_error();
    hard_edges();
    switching();
    swings();
    caught_at_the_rail();
    comes_to_rest();
    charge_of_a_swing();
    return check_end();
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What switches and diodes drop over current, and the heat that comes of it. The current is held by a large inductance: i
 * into A, half of it out of B and of C. */
#include <math.h>
#include <stdio.h>

#include "bench.h"
#include "check.h"

#define BUS_V      24.0
#define SWITCH_V   1.1
#define R_ON_OHM   0.02
#define DIODE_V    0.9
#define DIODE_OHM  0.03
#define DURATION_S 5e-6

static struct bridge with_drops(double i_a)
{
    struct inverter_params ip = bench_inverter;
    ip.supply_resistance_ohm = 0;
    ip.r_on_ohm = R_ON_OHM;
    ip.switch_v = SWITCH_V;
    ip.diode_v = DIODE_V;
    ip.diode_ohm = DIODE_OHM;
    ip.oc_trip_a = 100;
    struct bridge b = bridge_on_bench(&ip);
    struct motor_params p = bench_motor;
    p.ld_h = p.lq_h = 100;
    p.flux_wb = 0;
    motor_init(&b.m, &p, &bench_no_load);
    motor_lock(&b.m, true);
    motor_set_current(&b.m, i_a, 0);
    return b;
}

/* Drop of a switch in the direction of its current; of a diode likewise. */
static double switch_drop_v(double i_a)
{
    return SWITCH_V + R_ON_OHM * fabs(i_a);
}

static double diode_drop_v(double i_a)
{
    return DIODE_V + DIODE_OHM * fabs(i_a);
}

/* A against the star point, and the heat, with these drops in A and in each of B and C; of_a_v is A's rail over B's. */
static void check_drops(const char *name, struct bridge *b, unsigned gates, double of_a_v, double drop_a_v,
                        double drop_bc_v)
{
    char text[100];
    double i_a = b->m.i_d_a, sign = i_a > 0 ? 1 : -1;
    bridge_gates(b, A_HIGH_BC_LOW);
    bridge_gates(b, gates);
    bridge_advance(b, 1e-9); /* the drop follows the current of the last step */
    double before_vs = b->m.volt_alpha_vs, heat_j = b->inv.energy_conduction_j;
    bridge_advance(b, DURATION_S);
    snprintf(text, sizeof text, "%s, %g A: mean voltage of A (V)", name, i_a);
    check_near(text, (b->m.volt_alpha_vs - before_vs) / DURATION_S, 2.0 / 3 * (of_a_v - sign * (drop_a_v + drop_bc_v)),
               1e-4);
    snprintf(text, sizeof text, "%s, %g A: heat (W)", name, i_a);
    check_near(text, (b->inv.energy_conduction_j - heat_j) / DURATION_S, fabs(i_a) * (drop_a_v + drop_bc_v),
               1e-4 * fabs(i_a) * (drop_a_v + drop_bc_v) + 1e-9);
}

/* Backwards through a switch that is on flows an IGBT's diode current. */
static double on_drop_v(double i_a, bool back)
{
    return back ? diode_drop_v(i_a) : switch_drop_v(i_a);
}

static void any_current(double i_a)
{
    struct bridge b = with_drops(i_a);
    check_drops("switches", &b, A_HIGH_BC_LOW, BUS_V, on_drop_v(i_a, i_a < 0), on_drop_v(i_a / 2, i_a < 0));
    b = with_drops(i_a);
    check_drops("diodes", &b, 0, i_a > 0 ? -BUS_V : BUS_V, diode_drop_v(i_a), diode_drop_v(i_a / 2));
    b = with_drops(i_a);
    check_drops("a diode and switches", &b, GATE_LOW(1) | GATE_LOW(2), i_a > 0 ? 0 : BUS_V, diode_drop_v(i_a),
                on_drop_v(i_a / 2, i_a < 0));
}

/* Within a hundredth of the trip level the constant drop falls to zero with the current: no jump at zero. */
static void knee(void)
{
    struct bridge b = with_drops(0.5);
    check_drops("half way up the knee", &b, A_HIGH_BC_LOW, BUS_V, SWITCH_V / 2 + R_ON_OHM * 0.5,
                SWITCH_V / 4 + R_ON_OHM * 0.25);
    b = with_drops(0);
    check_drops("no current", &b, A_HIGH_BC_LOW, BUS_V, 0, 0);
}

/* A current that decays through a switch's constant drop comes to zero and stays there. */
static void decay(void)
{
    struct inverter_params ip = bench_inverter;
    ip.switch_v = SWITCH_V;
    ip.oc_trip_a = 100;
    struct bridge b = bridge_on_bench(&ip);
    motor_lock(&b.m, true);
    motor_set_current(&b.m, 12, 0);
    bridge_gates(&b, ALL_LOW);
    bridge_advance(&b, 50e-6);
    /* A drops its diode's constant part in one direction, B and C a switch's in the other, beside R i */
    double r_ohm = 0.3 + ip.r_on_ohm / 3, tau_s = 0.3e-3 / r_ohm, end_a = -2.0 / 3 * (SWITCH_V + ip.diode_v) / r_ohm;
    check_near("decay through a diode and two switches (A)", bridge_current(&b, 0),
               end_a + (12 - end_a) * exp(-50e-6 / tau_s), 2e-3);
    bridge_advance(&b, 5e-3);
    check_near("decay: to nothing (A)", bridge_current(&b, 0), 0, 0.01);
}

int main(void)
{
    static const double currents_a[] = {3, -3, 20, -20, 60};
    for (int n = 0; n < 5; n++) {
        any_current(currents_a[n]);
    }
    knee();
    decay();
    return check_end();
}

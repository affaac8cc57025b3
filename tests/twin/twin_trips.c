/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The comparators: when they trip, what of it reaches the gates, and the short circuit of a leg. */
#include <math.h>

#include "bench.h"
#include "check.h"

static void overcurrent(void)
{
    const double trip_a = 12, r = 0.3 + 5e-3, tau_s = 0.3e-3 / r, v = 2.0 / 3 * 24;
    struct inverter_params ip = bench_inverter;
    ip.supply_resistance_ohm = 0;
    ip.oc_trip_a = trip_a;
    struct bridge p = bridge_on_bench(&ip);
    motor_lock(&p.m, true);
    bridge_gates(&p, A_HIGH_BC_LOW);
    sim_ps tripped_at = inverter_advance(&p.inv, &p.m, 0, sim_from_s(5e-3));
    /* A carries i, B and C half of it: i = v/r (1 - exp(-t/tau)) with v of A against the star point */
    double expected_s = -tau_s * log(1 - trip_a * r / v);
    check_near("comparators: the instant of the trip (s)", sim_to_s(tripped_at), expected_s, 1e-9);
    check_near("comparators: at their level (A)", bridge_current(&p, 0), trip_a, 1e-5);
    check_true("comparators: output", p.inv.overcurrent);
    bridge_gates(&p, 0);
    bridge_advance(&p, 0.5e-3);
    check_true("comparators: release", !p.inv.overcurrent);
}

static void overcurrent_reaches_the_gates(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    params.inverter.oc_trip_a = 12;
    bench_start(&p, &params, (uint32_t[3]){4500, 500, 500});
    motor_lock(&p.motor, true);
    bench_run(&p, 5e-3);
    check_hex("over-current: latch set, input quiet again", bench_read(&p, GATE_STATUS), 0x2);
    check_equal("over-current: all six off", p.inverter.conduct, 0);
    check_near("over-current: the current has ended (A)", hypot(p.motor.i_d_a, p.motor.i_q_a), 0, 1e-12);
}

static double last_row_s, longest_gap_s, shortest_gap_s;

static void keep_gap(void *context, const struct plant_row *row)
{
    double gap_s = row->t_s - last_row_s;
    (void)context;
    longest_gap_s = fmax(longest_gap_s, last_row_s > 0 ? gap_s : 0);
    shortest_gap_s = fmin(shortest_gap_s, last_row_s > 0 ? gap_s : INFINITY);
    last_row_s = row->t_s;
}

/* The comparators trip between events; those that were due still come at their own time. Braking on the low sides for
 * most of a period, at several speeds, so that some trips are the last thing before a trigger. */
static void trip_keeps_time(void)
{
    struct plant_params params = bench_plant();
    int trips = 0;
    params.inverter.oc_trip_a = 8;
    longest_gap_s = 0;
    shortest_gap_s = INFINITY;
    for (int n = 0; n < 20; n++) {
        struct plant p;
        bench_start(&p, &params, (uint32_t[3]){200, 200, 200});
        motor_spin(&p.motor, 200 + 5 * n);
        p.on_trigger = keep_gap;
        last_row_s = 0;
        bench_run(&p, 3e-3);
        trips += bench_read(&p, GATE_STATUS) == 0x2;
    }
    check_equal("trips", trips, 20);
    check_near("triggers keep their time: longest gap (s)", longest_gap_s, 50e-6, 1e-12);
    check_near("triggers keep their time: shortest gap (s)", shortest_gap_s, 50e-6, 1e-12);
}

/* Turn-off slower than turn-on by more than the dead time: the new switch closes before the old one opens. */
static void shoot_through(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    params.inverter.turn_off_delay_s = 1.5e-6;
    params.inverter.oc_trip_a = 40;
    bench_start(&p, &params, (uint32_t[3]){2500, 2500, 2500});
    bench_run(&p, 1e-3);
    check_hex("shoot-through: OVERCURRENT, no INTERLOCK", bench_read(&p, GATE_STATUS), 0x2);
    check_equal("shoot-through: all six off", p.inverter.conduct, 0);
    check_true("shoot-through: the bus lost charge", p.inverter.energy_bridge_j > 0.01);
    check_near("shoot-through: nothing of it through the motor (A)", hypot(p.motor.i_d_a, p.motor.i_q_a), 0, 0.1);

    params.inverter.turn_off_delay_s = 0.9e-6;
    bench_start(&p, &params, (uint32_t[3]){2500, 2500, 2500});
    bench_run(&p, 1e-3);
    check_hex("a dead time that is longer: none", bench_read(&p, GATE_STATUS), 0x1);
}

/* Both switches of A: half the bus behind half of R_on, and the bus feeds the short circuit beside the motor. */
static void both_switches(void)
{
    const double r_on = 0.2, r = 0.3;
    struct inverter_params ip = bench_inverter;
    ip.supply_resistance_ohm = 0;
    ip.r_on_ohm = r_on;
    struct bridge p = bridge_on_bench(&ip);
    motor_lock(&p.m, true);
    bridge_gates(&p, A_HIGH_BC_LOW | GATE_LOW(0));
    bridge_advance(&p, 30e-3);
    double i_a = 12 / (r + r_on / 2 + (r + r_on) / 2), before_j = p.inv.energy_bridge_j;
    check_near("both switches: the motor's current (A)", bridge_current(&p, 0), i_a, 1e-6);
    bridge_advance(&p, 1e-3);
    check_near("both switches: power from the bus (W)", (p.inv.energy_bridge_j - before_j) / 1e-3,
               24 * (24 / (2 * r_on) + i_a / 2), 1e-3);
}

int main(void)
{
    overcurrent();
    overcurrent_reaches_the_gates();
    trip_keeps_time();
    shoot_through();
    both_switches();
    return check_end();
}

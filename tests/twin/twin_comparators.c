/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Blanking and delay of the comparators: exact instants, from a current whose course is known. */
#include <math.h>

#include "bench.h"
#include "check.h"

#define TRIP_A     12.0
#define BLANKING_S 3e-6
#define DELAY_S    1.5e-6

static struct bridge bridge_that_trips(double blanking_s, double delay_s)
{
    struct inverter_params ip = bench_inverter;
    ip.supply_resistance_ohm = 0;
    ip.oc_trip_a = TRIP_A;
    ip.oc_blanking_s = blanking_s;
    ip.oc_delay_s = delay_s;
    struct bridge b = bridge_on_bench(&ip);
    motor_lock(&b.m, true);
    return b;
}

/* A carries i = v/r (1 - exp(-t/tau)), B and C half of it. */
static double crossing_s(void)
{
    const double r = 0.3 + 5e-3, tau_s = 0.3e-3 / r, v = 2.0 / 3 * 24;
    return -tau_s * log(1 - TRIP_A * r / v);
}

/* When the gate block first sees it; a negative time if not until `until_s`. */
static double seen_s(struct bridge *b, double until_s)
{
    sim_ps end = b->now + sim_from_s(until_s);
    sim_ps at = inverter_advance(&b->inv, &b->m, b->now, end);
    b->now = at;
    return b->inv.overcurrent ? sim_to_s(at) : -1;
}

static void times(const char *name, double blanking_s, double delay_s)
{
    struct bridge b = bridge_that_trips(blanking_s, delay_s);
    bridge_gates(&b, A_HIGH_BC_LOW);
    check_near(name, seen_s(&b, 5e-3), crossing_s() + blanking_s + delay_s, 1e-9);
}

/* The over-current ends before the blanking does. */
static void too_short(void)
{
    struct bridge b = bridge_that_trips(BLANKING_S, DELAY_S);
    bridge_gates(&b, A_HIGH_BC_LOW);
    bridge_advance(&b, crossing_s() + 0.3 * BLANKING_S);
    check_true("beyond the level", fabs(bridge_current(&b, 0)) > TRIP_A);
    bridge_gates(&b, 0);
    check_near("shorter than the blanking: nothing", seen_s(&b, 1e-3), -1, 0);
}

/* The over-current ends after the blanking, within the delay: the pulse comes all the same, a delay later. */
static void delayed_pulse(void)
{
    struct bridge b = bridge_that_trips(0, DELAY_S);
    bridge_gates(&b, A_HIGH_BC_LOW);
    bridge_advance(&b, crossing_s() + 0.01e-6);
    bridge_gates(&b, 0);
    bridge_advance(&b, 0.5 * DELAY_S);
    check_true("released already", fabs(bridge_current(&b, 0)) < TRIP_A && !b.inv.overcurrent);
    check_near("the pulse comes a delay after the crossing (s)", seen_s(&b, 1e-3), crossing_s() + DELAY_S, 1e-9);
    bridge_advance(&b, 10 * DELAY_S);
    check_true("and ends", !b.inv.overcurrent);
}

/* A switch of the leg that turns on begins the blanking anew; one of another leg does not. */
static void turn_on_edges(void)
{
    struct bridge b = bridge_that_trips(BLANKING_S, 0);
    bridge_gates(&b, A_HIGH_BC_LOW);
    bridge_advance(&b, crossing_s() + BLANKING_S / 2);
    bridge_gates(&b, GATE_LOW(1) | GATE_LOW(2));
    bridge_gates(&b, A_HIGH_BC_LOW);
    check_near("turned on again: blanked from there (s)", seen_s(&b, 1e-3), crossing_s() + 1.5 * BLANKING_S, 1e-9);
    b = bridge_that_trips(BLANKING_S, 0);
    bridge_gates(&b, A_HIGH_BC_LOW);
    bridge_advance(&b, crossing_s() + BLANKING_S / 2);
    bridge_gates(&b, GATE_HIGH(0) | GATE_LOW(2));
    bridge_gates(&b, A_HIGH_BC_LOW);
    check_near("another leg turned on: the same (s)", seen_s(&b, 1e-3), crossing_s() + BLANKING_S, 1e-9);
}

/* Both switches of a leg: the bus's comparator, from the moment of it. */
static void shoot_through(void)
{
    struct bridge b = bridge_that_trips(BLANKING_S, DELAY_S);
    bridge_gates(&b, ALL_LOW);
    bridge_advance(&b, 10e-6);
    bridge_gates(&b, ALL_LOW | GATE_HIGH(0));
    check_near("shoot-through (s)", seen_s(&b, 1e-3), 10e-6 + BLANKING_S + DELAY_S, 1e-9);
    check_true("through the bridge, not the motor", fabs(bridge_current(&b, 0)) < TRIP_A);
}

/* The plant: the latch sets at that instant, and the gates follow. */
static double first_row_s, last_row_s;
static unsigned last_gates;

static void keep(void *context, const struct plant_row *row)
{
    (void)context;
    first_row_s = first_row_s > 0 ? first_row_s : row->t_s;
    last_row_s = row->t_s;
    last_gates = row->gates;
}

static void in_the_plant(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    params.inverter.oc_trip_a = 8;
    params.inverter.oc_blanking_s = BLANKING_S;
    params.inverter.oc_delay_s = DELAY_S;
    bench_start(&p, &params, (uint32_t[3]){4500, 500, 500});
    motor_lock(&p.motor, true);
    p.on_trigger = keep;
    sim_ps beyond_at = 0;
    while (!p.inverter.overcurrent && p.now < sim_from_s(5e-3)) {
        double i_a[3];
        motor_currents(&p.motor, i_a);
        beyond_at = fabs(i_a[0]) > 8 && beyond_at == 0 ? p.now : beyond_at;
        bench_run(&p, 10e-9);
    }
    check_near("plant: blanking and delay after the crossing (s)", sim_to_s(p.now - beyond_at), BLANKING_S + DELAY_S,
               25e-9);
    check_hex("plant: latched, gates off", bench_read(&p, GATE_STATUS) & 0x3, 0x2);
    check_equal("plant: all six off", p.inverter.conduct, 0);
    bench_run(&p, 1e-3);
    check_hex("plant: the latch stays, the input is quiet", bench_read(&p, GATE_STATUS), 0x2);
    check_near("plant: triggers keep their time (s)", remainder(last_row_s - first_row_s, 50e-6), 0, 1e-12);
    check_equal("plant: gates in the rows", last_gates, 0);
}

int main(void)
{
    times("neither: at the crossing (s)", 0, 0);
    times("blanking (s)", BLANKING_S, 0);
    times("delay (s)", 0, DELAY_S);
    times("both (s)", BLANKING_S, DELAY_S);
    too_short();
    delayed_pulse();
    turn_on_edges();
    shoot_through();
    in_the_plant();
    return check_end();
}

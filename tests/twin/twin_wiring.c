/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What can happen to the motor's cable: two terminals joined, a wire broken. */
#include <math.h>

#include "bench.h"
#include "check.h"

#define SQRT3 1.7320508075688772

/* Terminal voltages from the leg currents by Ohm's law, on switches of r_on. */
static void terminals(const struct bridge *p, double bus_v, double r_on, double v_v[3])
{
    double leg_a[3];
    inverter_leg_currents(&p->inv, &p->m, leg_a);
    for (int k = 0; k < 3; k++) {
        v_v[k] = (p->inv.leg[k] == LEG_HIGH ? bus_v : 0) - r_on * leg_a[k];
    }
}

/* Locked long enough, every phase is its resistance to a common star point. Switches of 0.2 ohm, to matter. */
static void phase_short(void)
{
    const double short_ohm = 0.5, r_on = 0.2;
    double leg_a[3], motor_a[3], v_v[3];
    struct inverter_params ip = bench_inverter;
    ip.supply_resistance_ohm = 0;
    ip.r_on_ohm = r_on;
    struct bridge p = bridge_on_bench(&ip);
    motor_lock(&p.m, true);
    bridge_gates(&p, A_HIGH_BC_LOW);
    inverter_short(&p.inv, 0, 1, short_ohm);
    bridge_advance(&p, 30e-3);
    inverter_leg_currents(&p.inv, &p.m, leg_a);
    motor_currents(&p.m, motor_a);
    terminals(&p, 24, r_on, v_v);
    check_near("short: the current through it (A)", leg_a[0] - motor_a[0], (v_v[0] - v_v[1]) / short_ohm, 1e-6);
    check_near("short: it returns in the other leg (A)", leg_a[1] - motor_a[1], motor_a[0] - leg_a[0], 1e-6);
    check_near("short: the third leg has no part (A)", leg_a[2], motor_a[2], 1e-9);
    double star_v = v_v[0] - 0.3 * motor_a[0];
    check_near("short: A and B agree on the star point (V)", v_v[1] - 0.3 * motor_a[1], star_v, 1e-6);
    check_near("short: A and C agree on the star point (V)", v_v[2] - 0.3 * motor_a[2], star_v, 1e-6);
    inverter_short_off(&p.inv);
    inverter_leg_currents(&p.inv, &p.m, leg_a);
    check_near("short off: leg and motor agree (A)", leg_a[0], motor_a[0], 1e-12);
}

/* A off, its terminal tied to B's: all of A's motor current passes the short and B's switch. */
static void short_to_an_idle_leg(int from, int to)
{
    const double short_ohm = 0.4, r_on = 0.2;
    double leg_a[3], motor_a[3];
    struct inverter_params ip = bench_inverter;
    ip.supply_resistance_ohm = 0;
    ip.r_on_ohm = r_on;
    struct bridge p = bridge_on_bench(&ip);
    motor_lock(&p.m, true);
    bridge_gates(&p, GATE_HIGH(1) | GATE_LOW(2));
    inverter_short(&p.inv, from, to, short_ohm);
    bridge_advance(&p, 30e-3);
    inverter_leg_currents(&p.inv, &p.m, leg_a);
    motor_currents(&p.m, motor_a);
    /* B feeds A's phase through the short, in parallel with its own; both return through C */
    double a_ohm = 0.3 + short_ohm, b_ohm = 0.3, both_ohm = a_ohm * b_ohm / (a_ohm + b_ohm);
    double total_a = 24 / (2 * r_on + both_ohm + 0.3);
    check_near("short to an idle leg: B's switch carries all (A)", leg_a[1], total_a, 1e-6);
    check_near("short to an idle leg: A's share (A)", motor_a[0], total_a * both_ohm / a_ohm, 1e-6);
    check_near("short to an idle leg: nothing in A's switches (A)", leg_a[0], 0, 1e-9);
}

/* The switches of A and B off and the rotor turned slowly, so that resistances decide and no diode starts: the EMF of A
 * and B circulates through the short, C and the bridge have no part, even with a switch of C on. */
static void short_without_bridge(unsigned gates)
{
    const double short_ohm = 0.4, speed_rad_s = 5;
    double peak_a = 0, in_c_a = 0, in_leg_a = 0, leg_a[3], motor_a[3];
    struct bridge p = bridge_on_bench(&bench_inverter);
    bridge_gates(&p, gates);
    inverter_short(&p.inv, 0, 1, short_ohm);
    motor_spin(&p.m, speed_rad_s);
    for (int n = 0; n < 4000; n++) {
        bridge_advance(&p, 100e-6);
        inverter_leg_currents(&p.inv, &p.m, leg_a);
        motor_currents(&p.m, motor_a);
        peak_a = fmax(peak_a, motor_a[0]);
        in_c_a = fmax(in_c_a, fabs(motor_a[2]));
        in_leg_a = fmax(in_leg_a, fabs(leg_a[0]) + fabs(leg_a[1]));
    }
    double emf_v = SQRT3 * bench_motor.flux_wb * bench_motor.pole_pairs * speed_rad_s;
    check_near("short without bridge: EMF over the loop (A)", peak_a, emf_v / (2 * 0.3 + short_ohm), 1e-3);
    check_near("short without bridge: nothing in C (A)", in_c_a, 0, 1e-9);
    check_near("short without bridge: nothing in the legs (A)", in_leg_a, 0, 1e-9);
}

static void open_wire(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    bench_start(&p, &params, (uint32_t[3]){2600, 2400, 2500});
    motor_spin(&p.motor, 100);
    bench_run(&p, 0.01);
    inverter_open_wire(&p.inverter, 0, true);
    double in_a = 0, in_b = 0, i_a[3];
    for (int n = 0; n < 1000; n++) {
        bench_run(&p, 7e-6);
        motor_currents(&p.motor, i_a);
        in_a = fmax(in_a, fabs(i_a[0]));
        in_b = fmax(in_b, fabs(i_a[1]));
    }
    check_near("open phase: carries nothing (A)", in_a, 0, 1e-9);
    check_between("open phase: the others go on (A)", in_b, 0.5, 20);
    inverter_open_wire(&p.inverter, 0, false);
    bench_run(&p, 1e-3);
    motor_currents(&p.motor, i_a);
    check_true("closed again: it carries", fabs(i_a[0]) > 0.1);
}

/* ---- two wires exchanged ---- */

/* Locked, A high and the others low: the current of leg A is that of the motor's phase on its wire, and returns in equal
 * parts; the sensors stay with the legs. */
static void swapped(int one, int other)
{
    double leg_a[3], motor_a[3];
    struct inverter_params ip = bench_inverter;
    ip.supply_resistance_ohm = 0;
    ip.coss_c = 100e-9;
    struct bridge p = bridge_on_bench(&ip);
    motor_lock(&p.m, true);
    inverter_swap_wires(&p.inv, one, other);
    bridge_gates(&p, A_HIGH_BC_LOW);
    bridge_advance(&p, 30e-3);
    inverter_leg_currents(&p.inv, &p.m, leg_a);
    motor_currents(&p.m, motor_a);
    double i_a = 24 / (1.5 * (0.3 + 5e-3));
    check_near("swapped: leg A (A)", leg_a[0], i_a, 1e-6);
    check_near("swapped: leg B (A)", leg_a[1], -i_a / 2, 1e-6);
    check_near("swapped: the motor's phase on A's wire (A)", motor_a[one == 0 ? other : (other == 0 ? one : 0)], i_a,
               1e-6);
    inverter_swap_off(&p.inv);
    bridge_advance(&p, 30e-3);
    motor_currents(&p.m, motor_a);
    check_near("swapped back (A)", motor_a[0], i_a, 1e-6);
}

/* Two wires exchanged turn the field the other way round. The legs' field turns slowly; where the motor's current points
 * follows it, one way or the other. */
static double turn_of_the_current_rad(bool swap)
{
    static const unsigned sixth[6] = {
        GATE_HIGH(0) | GATE_LOW(1) | GATE_LOW(2), GATE_HIGH(0) | GATE_HIGH(1) | GATE_LOW(2),
        GATE_LOW(0) | GATE_HIGH(1) | GATE_LOW(2), GATE_LOW(0) | GATE_HIGH(1) | GATE_HIGH(2),
        GATE_LOW(0) | GATE_LOW(1) | GATE_HIGH(2), GATE_HIGH(0) | GATE_LOW(1) | GATE_HIGH(2)};
    struct bridge p = bridge_on_bench(&bench_inverter);
    double turned_rad = 0, before_rad = 0;
    motor_lock(&p.m, true);
    if (swap) {
        inverter_swap_wires(&p.inv, 1, 2);
    }
    for (int n = 0; n < 13; n++) {
        bridge_gates(&p, sixth[n % 6]);
        bridge_advance(&p, 10e-3);
        double rad = atan2(p.m.i_q_a, p.m.i_d_a); /* the rotor is locked at angle 0 */
        turned_rad += n > 0 ? remainder(rad - before_rad, 6.283185307179586) : 0;
        before_rad = rad;
    }
    return turned_rad;
}

static void swapped_field(void)
{
    check_near("wires as they should be: two turns forwards (rad)", turn_of_the_current_rad(false), 12.566, 0.01);
    check_near("two exchanged: two turns backwards (rad)", turn_of_the_current_rad(true), -12.566, 0.01);
}

/* Exchanged, and beside it another fault: both are of the legs' wires, so the motor's other phase has them. */
static void swapped_with_faults(void)
{
    const double short_ohm = 0.5;
    double leg_a[3], motor_a[3], plain_leg_a[3];
    struct inverter_params ip = bench_inverter;
    ip.supply_resistance_ohm = 0;
    struct bridge p = bridge_on_bench(&ip), q;
    motor_lock(&p.m, true);
    inverter_swap_wires(&p.inv, 0, 1);
    inverter_open_wire(&p.inv, 0, true);
    bridge_gates(&p, GATE_HIGH(1) | GATE_LOW(0) | GATE_LOW(2));
    bridge_advance(&p, 30e-3);
    motor_currents(&p.m, motor_a);
    check_near("A's wire broken and on B: the motor's B (A)", motor_a[1], 0, 1e-9);
    check_near("A's wire broken and on B: leg B feeds A (A)", motor_a[0], 24 / (2 * 0.305), 1e-6);

    p = bridge_on_bench(&ip);
    motor_lock(&p.m, true);
    q = p;
    inverter_swap_wires(&p.inv, 0, 1);
    for (int n = 0; n < 2; n++) {
        struct bridge *b = n ? &q : &p;
        inverter_short(&b->inv, 0, 2, short_ohm);
        bridge_gates(b, A_HIGH_BC_LOW);
        bridge_advance(b, 30e-3);
    }
    inverter_leg_currents(&p.inv, &p.m, leg_a);
    inverter_leg_currents(&q.inv, &q.m, plain_leg_a);
    check_near("a short at the legs is the same for them: A (A)", leg_a[0], plain_leg_a[0], 1e-6);
    check_near("a short at the legs is the same for them: C (A)", leg_a[2], plain_leg_a[2], 1e-6);
}

/* A short behind a bus with resistance and inductance, all effects on: Ohm's law once it is steady. */
static void short_on_a_soft_bus(void)
{
    const double short_ohm = 0.5, r_on = 0.2, source_ohm = 0.3;
    double leg_a[3], motor_a[3], v_v[3];
    struct inverter_params ip = bench_inverter;
    ip.supply_resistance_ohm = source_ohm;
    ip.supply_inductance_h = 1e-6;
    ip.bus_esr_ohm = 0.02;
    ip.coss_c = 100e-9;
    ip.r_on_ohm = r_on;
    struct bridge p = bridge_on_bench(&ip);
    motor_lock(&p.m, true);
    bridge_gates(&p, A_HIGH_BC_LOW);
    inverter_short(&p.inv, 0, 1, short_ohm);
    bridge_advance(&p, 60e-3);
    inverter_leg_currents(&p.inv, &p.m, leg_a);
    motor_currents(&p.m, motor_a);
    double bus_v = 24 - source_ohm * leg_a[0];
    check_near("soft bus: at the bridge (V)", p.inv.bus_v, bus_v, 1e-4);
    terminals(&p, bus_v, r_on, v_v);
    check_near("soft bus: the current through the short (A)", leg_a[0] - motor_a[0], (v_v[0] - v_v[1]) / short_ohm,
               1e-4);
    check_near("soft bus: A and C agree on the star point (V)", v_v[2] - 0.3 * motor_a[2], v_v[0] - 0.3 * motor_a[0],
               1e-4);
}

int main(void)
{
    swapped(0, 1);
    swapped(1, 2);
    swapped(2, 0);
    swapped_field();
    swapped_with_faults();
    short_on_a_soft_bus();
    phase_short();
    short_to_an_idle_leg(0, 1);
    short_to_an_idle_leg(1, 0);
    short_without_bridge(0);
    short_without_bridge(GATE_LOW(2));
    open_wire();
    return check_end();
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The bridge at switch level, with a motor on it: what the dead time does, when diodes conduct, what the bus does.
 * Cases small enough for a closed form; random ones are in twin_energy.c. */
#include "inverter.h"

#include <math.h>

#include "bench.h"
#include "bus.h"
#include "check.h"

#define SQRT3 1.7320508075688772

/* ---- dead time ---- */

static struct plant_row last_row;

static void keep_row(void *context, const struct plant_row *row)
{
    (void)context;
    last_row = *row;
}

/* A's mean voltage against the star point with A at on_a counts and B, C at on_bc, once the currents are steady; the
 * rotor is locked. While both switches are off, a leg whose current flows out of it lies one diode below the lower
 * rail, and one diode above the upper rail if it flows in: the current keeps its sign. */
static void dead_time(const char *name, uint32_t on_a, uint32_t on_bc, double delay_on_s, double delay_off_s)
{
    struct plant_params params = bench_plant();
    struct plant p;
    params.inverter.supply_resistance_ohm = 0;
    params.inverter.turn_on_delay_s = delay_on_s;
    params.inverter.turn_off_delay_s = delay_off_s;
    bench_start(&p, &params, (uint32_t[3]){on_a, on_bc, on_bc});
    motor_lock(&p.motor, true);
    p.on_trigger = keep_row;
    bench_run(&p, 0.02);

    const double period_s = 50e-6, count_s = 10e-9, bus_v = 24, diode_v = 0.8, r_on = 5e-3;
    bool out_of_a = on_a > on_bc;
    double both_off_s = 2 * (BENCH_DEAD_COUNTS * count_s + delay_on_s - delay_off_s);
    double high_a_s = on_a * count_s + delay_off_s - delay_on_s, high_bc_s = on_bc * count_s + delay_off_s - delay_on_s;
    double off_a_v = out_of_a ? -diode_v : bus_v + diode_v, off_bc_v = out_of_a ? bus_v + diode_v : -diode_v;
    double i_a = last_row.i_a[0], on_share = (period_s - both_off_s) / period_s;
    double leg_a_v = (high_a_s * bus_v + both_off_s * off_a_v) / period_s - r_on * i_a * on_share;
    double leg_bc_v = (high_bc_s * bus_v + both_off_s * off_bc_v) / period_s + r_on * i_a / 2 * on_share;
    /* 1 mV: the ripple of the current, up to 0.2 A, on the switches' 5 mohm */
    check_near(name, last_row.v_mean_v[0], 2.0 / 3 * (leg_a_v - leg_bc_v), 1e-3);
    check_near("A and the star point: B and C share the return (V)", last_row.v_mean_v[1], -last_row.v_mean_v[0] / 2,
               1e-6);
    check_true("current flows from the higher to the lower", (i_a > 0) == out_of_a && fabs(i_a) > 1);
}

/* What else a row says. */
static void row(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    bench_start(&p, &params, (uint32_t[3]){3000, 2400, 1800});
    motor_lock(&p.motor, true);
    p.motor.load_nm = 0.25;
    p.on_trigger = keep_row;
    bench_run(&p, 5e-3 + 2e-6);
    check_near("row: high side of A (duty)", last_row.duty[0], 0.6, 1e-9);
    check_near("row: high side of B (duty)", last_row.duty[1], 0.48, 1e-9);
    check_near("row: high side of C (duty)", last_row.duty[2], 0.36, 1e-9);
    check_near("row: phase voltages sum to zero (V)",
               last_row.v_mean_v[0] + last_row.v_mean_v[1] + last_row.v_mean_v[2], 0, 1e-9);
    check_near("row: the bus is the capacitor's (V)", last_row.bus_v, p.inverter.bus_v, 0.01);
    check_true("row: which the supply's resistance lowers", last_row.bus_v < 23.99);
    check_near("row: torque (N m)", last_row.torque_nm, motor_torque_nm(&p.motor), 0.01);
    check_near("row: load (N m)", last_row.load_nm, 0.25, 0);
    check_hex("row: low sides on", last_row.gates, ALL_LOW);
    check_true("row: live", last_row.live);
}

/* The error against the ideal bridge opposes the current. */
static double voltage_error(uint32_t on_a, uint32_t on_bc)
{
    struct plant_params params = bench_plant();
    struct plant p;
    params.inverter.supply_resistance_ohm = 0;
    bench_start(&p, &params, (uint32_t[3]){on_a, on_bc, on_bc});
    motor_lock(&p.motor, true);
    p.on_trigger = keep_row;
    bench_run(&p, 0.02);
    return last_row.v_mean_v[0] - 2.0 / 3 * 24 * ((double)on_a - on_bc) / BENCH_PERIOD_COUNTS;
}

static void dead_time_sign(void)
{
    /* 4/3 of (dead share of bus and two diodes): 100 of 5000 counts of 24 V + 1.6 V = 0.68 V, and the switches' drop */
    check_between("dead time: the voltage error opposes a current out of A (V)", voltage_error(2800, 2400), -0.75,
                  -0.68);
    check_between("dead time: the voltage error opposes a current into A (V)", voltage_error(2400, 2800), 0.68, 0.75);
    check_near("dead time: no current, no error (V)", voltage_error(2500, 2500), 0, 1e-9);
}

/* A pulse shorter than the turn-on delay does not reach the switch. */
static void delays(void)
{
    struct inverter_params ip = bench_inverter;
    ip.turn_on_delay_s = 300e-9;
    ip.turn_off_delay_s = 100e-9;
    struct bridge p = bridge_on_bench(&ip);
    bridge_gates(&p, GATE_HIGH(0));
    check_equal("turn-on delay (ps)", inverter_next_switch(&p.inv), 300000);
    bridge_advance(&p, 299e-9);
    check_equal("still off", p.inv.conduct, 0);
    bridge_advance(&p, 2e-9);
    check_equal("then on", p.inv.conduct, GATE_HIGH(0));
    bridge_gates(&p, 0);
    bridge_advance(&p, 99e-9);
    check_equal("still on", p.inv.conduct, GATE_HIGH(0));
    bridge_advance(&p, 2e-9);
    check_equal("turn-off delay", p.inv.conduct, 0);
    bridge_gates(&p, GATE_HIGH(0));
    bridge_advance(&p, 200e-9);
    bridge_gates(&p, 0);
    check_true("too short a pulse is cancelled", inverter_next_switch(&p.inv) == SIM_NEVER);
}

/* ---- diodes ---- */

/* Locked at angle 0, current out of A: lower diode of A, upper diodes of B and C, so -(2/3)(bus + 2 V_diode) drives the
 * current through R and Ld to zero, where the diodes end it. */
static void freewheel(void)
{
    const double i0 = 8, bus_v = 24, r = 0.3, tau_s = 0.3e-3 / 0.3, v = 2.0 / 3 * (bus_v + 1.6);
    double zero_at_s = tau_s * log(1 + r * i0 / v);
    struct inverter_params ip = bench_inverter;
    ip.supply_resistance_ohm = 0;
    struct bridge p = bridge_on_bench(&ip);
    motor_lock(&p.m, true);
    motor_set_current(&p.m, i0, 0);
    bridge_gates(&p, A_HIGH_BC_LOW);
    bridge_gates(&p, 0);
    bridge_advance(&p, 10e-6);
    check_near("freewheel: after 10 us (A)", bridge_current(&p, 0), (i0 + v / r) * exp(-10e-6 / tau_s) - v / r, 1e-5);
    check_equal("freewheel: lower diode of A", p.inv.leg[0], LEG_DIODE_LO);
    check_equal("freewheel: upper diode of B", p.inv.leg[1], LEG_DIODE_HI);
    bridge_advance(&p, zero_at_s - 10e-6 - 10e-9);
    check_between("freewheel: 10 ns before zero (A)", bridge_current(&p, 0), 0.2 * v / 0.3e-3 * 10e-9,
                  2 * v / 0.3e-3 * 10e-9);
    bridge_advance(&p, 20e-9);
    check_near("freewheel: 10 ns after it, exactly none (A)", hypot(p.m.i_d_a, p.m.i_q_a), 0, 1e-12);
    bridge_advance(&p, 1e-3);
    check_near("freewheel: and none later (A)", hypot(p.m.i_d_a, p.m.i_q_a), 0, 1e-12);
    check_true("freewheel: all blocked",
               p.inv.leg[0] == LEG_BLOCKED && p.inv.leg[1] == LEG_BLOCKED && p.inv.leg[2] == LEG_BLOCKED);
}

/* Speed at which the line-to-line EMF peaks at v. */
static double speed_for(double v)
{
    return v / (SQRT3 * bench_motor.flux_wb * bench_motor.pole_pairs);
}

static double largest_current(struct bridge *p, double duration_s)
{
    double largest_a = 0;
    for (double t_s = 0; t_s < duration_s; t_s += 5e-6) {
        bridge_advance(p, 5e-6);
        largest_a = fmax(largest_a, hypot(p->m.i_d_a, p->m.i_q_a));
    }
    return largest_a;
}

static void rectifier(void)
{
    const double threshold_v = 24 + 2 * 0.8;
    struct bridge p = bridge_on_bench(&bench_inverter);
    motor_spin(&p.m, speed_for(0.999 * threshold_v));
    check_near("rectifier: EMF 0.1 % below bus + 2 V_diode, no current (A)", largest_current(&p, 0.02), 0, 1e-12);
    p = bridge_on_bench(&bench_inverter);
    motor_spin(&p.m, speed_for(1.01 * threshold_v));
    check_between("rectifier: EMF 1 % above, current (A)", largest_current(&p, 0.02), 0.01, 1);
    check_true("rectifier: it brakes", p.m.energy_airgap_j < 0);
    check_true("rectifier: the supply takes it", p.inv.energy_supply_j < 0);

    /* a supply that does not sink: the bus follows the EMF up, and stays when the EMF falls */
    struct inverter_params ip = bench_inverter;
    ip.supply_sinks = 0;
    ip.vbus_v = 38; /* near the end: from far below, the charge would ring beyond it */
    ip.bus_capacitance_f = 50e-6;
    p = bridge_on_bench(&ip);
    motor_spin(&p.m, speed_for(40));
    bridge_advance(&p, 0.1);
    check_near("rectifier: the bus settles at EMF - 2 V_diode (V)", p.inv.bus_v, 40 - 1.6, 0.03);
    motor_spin(&p.m, speed_for(20));
    bridge_advance(&p, 0.001);
    double kept_v = p.inv.bus_v;
    bridge_advance(&p, 0.05);
    check_near("rectifier: and keeps it (V)", p.inv.bus_v, kept_v, 1e-9);
}

/* ---- bus ---- */

/* The closed form against 20000 small steps of C dv/dt = (supply - v) / R - i, for both kinds of supply. */
static void bus_against_small_steps(void)
{
    double error_v = 0;
    for (int n = 0; n < 400; n++) {
        struct bus bus = {24, any_real(0.02, 1), any_real(10e-6, 1e-3), n % 2};
        double v0 = any_real(20, 28), i = any_real(-30, 30), dt_s = any_real(1e-6, 1e-4), v = v0;
        const int steps = 20000;
        for (int k = 0; k < steps; k++) {
            double from_supply = (bus.supply_v - v) / bus.resistance_ohm;
            if (!bus.sinks && from_supply < 0) {
                from_supply = 0;
            }
            v += dt_s / steps * (from_supply - i) / bus.capacitance_f;
        }
        error_v = fmax(error_v, fabs(bus_voltage_after(&bus, v0, i, dt_s) - v));
    }
    check_near("bus capacitor against 20000 Euler steps, worst (V)", error_v, 0, 0.01);
    struct bus stiff = {24, 0, 1e-3, true};
    check_near("a supply without resistance (V)", bus_voltage_after(&stiff, 24, 50, 1e-3), 24, 0);
}

/* Nothing supplied, nothing taken: what the bridge draws comes from the capacitor's charge. */
static void bus_charge(void)
{
    struct inverter_params ip = bench_inverter;
    ip.supply_resistance_ohm = 1e3; /* as good as disconnected: 1 mA at most */
    struct bridge p = bridge_on_bench(&ip);
    motor_lock(&p.m, true);
    bridge_gates(&p, A_HIGH_BC_LOW);
    double charge_as = 0;
    for (int n = 0; n < 500; n++) {
        double before_a = bridge_current(&p, 0);
        bridge_advance(&p, 1e-6);
        charge_as += (before_a + bridge_current(&p, 0)) / 2 * 1e-6;
    }
    check_near("bus: the charge that A's high side took (V)", 24 - p.inv.bus_v, charge_as / 1e-3, 1e-3);
    bridge_gates(&p, ALL_LOW);
    double held_v = p.inv.bus_v;
    bridge_advance(&p, 100e-6);
    check_near("bus: a freewheeling current takes none (V)", p.inv.bus_v, held_v, 1e-3);
}

int main(void)
{
    dead_time("mean voltage, current out of A (V)", 2800, 2400, 0, 0);
    dead_time("mean voltage, current into A (V)", 2400, 2800, 0, 0);
    dead_time("mean voltage with slower turn-on (V)", 2800, 2400, 300e-9, 100e-9);
    dead_time("mean voltage with slower turn-off (V)", 2400, 2800, 100e-9, 250e-9);
    dead_time_sign();
    row();
    delays();
    freewheel();
    rectifier();
    bus_against_small_steps();
    bus_charge();
    return check_end();
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Any bridge, any switching, any fault of the wiring, and all of it at once: currents stay finite and sum to zero, open
 * wires carry nothing, and no energy comes from nowhere. */
#include <math.h>

#include "bench.h"
#include "check.h"
#include "coss.h"

#define RUNS   60
#define PIECES 200

/* A value of the range, or its neutral zero. */
static double maybe(double low, double high)
{
    return any_between(0, 2) ? any_real(low, high) : 0;
}

static struct inverter_params any_params(void)
{
    struct inverter_params p = bench_inverter;
    bool battery = any_between(0, 1);
    p.supply_resistance_ohm = any_real(0.01, 0.5);
    p.supply_sinks = any_between(0, 1);
    p.supply_inductance_h = maybe(1e-7, 1e-4);
    p.supply_r2_ohm = battery ? any_real(0.01, 0.1) : 0;
    p.supply_c2_f = battery ? any_real(0.01, 10) : 0;
    p.rectifier_hz = maybe(40, 70);
    p.bus_capacitance_f = any_real(20e-6, 2e-3);
    p.bus_esr_ohm = maybe(1e-3, 0.3);
    p.chopper_ohm = maybe(0.5, 10);
    p.chopper_off_v = 27;
    p.chopper_on_v = any_real(27, 32);
    p.switch_v = maybe(0, 1.5);
    p.diode_ohm = maybe(0, 0.1);
    p.coss_c = maybe(1e-9, 400e-9);
    p.oc_trip_a = any_real(20, 100);
    p.oc_blanking_s = maybe(0, 10e-6);
    p.oc_delay_s = maybe(0, 5e-6);
    return p;
}

static unsigned any_gates(bool faulty)
{
    unsigned gates = 0;
    for (int k = 0; k < 3; k++) {
        gates |= (unsigned[]){0, GATE_HIGH(k), GATE_LOW(k), GATE_LOW(k)}[any_between(0, 3)];
    }
    return faulty && any_between(0, 60) == 0 ? gates | GATE_HIGH(0) | GATE_LOW(0) : gates;
}

static void any_fault(struct bridge *b)
{
    int k = any_between(0, 2);
    switch (any_between(0, 60)) {
    case 0:
        inverter_short(&b->inv, k, (k + 1) % 3, any_real(0.01, 10));
        break;
    case 1:
        inverter_short_off(&b->inv);
        break;
    case 2:
        inverter_open_wire(&b->inv, k, any_between(0, 1));
        break;
    case 3:
        inverter_swap_wires(&b->inv, k, (k + 1) % 3);
        break;
    case 4:
        inverter_swap_off(&b->inv);
        break;
    case 5:
        inverter_chopper(&b->inv, any_between(0, 1));
        break;
    case 6:
        b->inv.p.supply_sinks = any_between(0, 1);
        break;
    case 7:
        motor_spin(&b->m, any_real(-1500, 1500));
        break;
    default:
        break;
    }
}

struct worst {
    bool finite;
    double sum_a, open_a, gained_j;
};

static void watch(const struct bridge *b, struct worst *w)
{
    double leg_a[3];
    inverter_leg_currents(&b->inv, &b->m, leg_a);
    w->finite = w->finite && isfinite(leg_a[0] + leg_a[1] + leg_a[2] + b->inv.bus_v + b->inv.supply.feed_a +
                                      b->inv.node[0].v + b->inv.node[1].v + b->inv.node[2].v);
    w->sum_a = fmax(w->sum_a, fabs(leg_a[0] + leg_a[1] + leg_a[2]));
    for (int k = 0; k < 3; k++) {
        bool shorted = k == b->inv.short_from || k == b->inv.short_to;
        w->open_a = fmax(w->open_a, b->inv.wire_open[k] && b->inv.short_from < 0 && !shorted ? fabs(leg_a[k]) : 0);
    }
}

static double drive(struct bridge *b, bool faulty, struct worst *w)
{
    struct motor_params p = bench_motor;
    p.ld_h = any_between(0, 1) ? 25e-6 : 0.3e-3;
    p.lq_h = 1.4 * p.ld_h;
    motor_init(&b->m, &p, &bench_no_load);
    motor_spin(&b->m, any_real(-1000, 1000));
    double stored_j = supply_stored_j(&b->inv.supply, &b->inv.p) + coss_stored_j(&b->inv);
    for (int n = 0; n < PIECES; n++) {
        if (faulty) {
            any_fault(b);
        }
        bridge_gates(b, any_gates(faulty));
        bridge_advance(b, any_real(1e-9, 40e-6));
        watch(b, w);
    }
    stored_j -= supply_stored_j(&b->inv.supply, &b->inv.p) + coss_stored_j(&b->inv);
    return b->m.energy_in_j + b->inv.supply.heat_j + b->inv.supply.chopper_j + b->inv.energy_conduction_j +
           b->inv.energy_edges_j + b->inv.energy_switching_j - b->inv.energy_supply_j - stored_j;
}

int main(void)
{
    struct worst sound = {.finite = true}, faulty = {.finite = true};
    for (int run = 0; run < RUNS; run++) {
        struct inverter_params ip = any_params();
        struct bridge b = bridge_on_bench(&ip);
        double gained_j = drive(&b, false, &sound);
        double through_j = fabs(b.inv.energy_bridge_j) + fabs(b.inv.energy_supply_j) + 0.1;
        sound.gained_j = fmax(sound.gained_j, fabs(gained_j) / through_j);
        b = bridge_on_bench(&ip);
        drive(&b, true, &faulty);
    }
    check_true("any bridge: finite", sound.finite);
    check_near("any bridge: leg currents sum to zero (A)", sound.sum_a, 0, 1e-9);
    check_near("any bridge: share of the energy left open, worst", sound.gained_j, 0, 2e-3);
    check_true("with faults: finite", faulty.finite);
    check_near("with faults: leg currents sum to zero (A)", faulty.sum_a, 0, 1e-7);
    check_near("with faults: open wires carry nothing (A)", faulty.open_a, 0, 1e-6);
    for (int n = 0; n < RUNS; n++) {
        struct inverter_params ip = any_params();
        ip.vbus_v = 24;
        check_true("any parameters of these go together", inverter_mismatch(&ip) == NULL);
    }
    return check_end();
}

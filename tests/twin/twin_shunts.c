/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Which of a leg's currents its sensor carries: a shunt below the low side what comes through there, a sensor in line
 * with the phase all of it. */
#include <math.h>
#include <stdlib.h>

#include "bench.h"
#include "check.h"
#include "legs.h"

#define LSB_A (25.0 / 2048)

static void each_state(void)
{
    struct inverter inv;
    inverter_init(&inv, &bench_inverter);
    static const struct {
        enum leg_state state;
        double into_motor_a, low_a;
        int level;
    } cases[] = {
        {LEG_LOW, 3, 3, -1},    {LEG_LOW, -3, -3, -1},    {LEG_HIGH, 3, 0, 1},
        {LEG_HIGH, -3, 0, 1},   {LEG_DIODE_LO, 3, 3, -1}, {LEG_DIODE_HI, -3, 0, 1},
        {LEG_BLOCKED, 0, 0, 0}, {LEG_JUST_OFF, 3, 3, 0},  {LEG_JUST_OFF, -3, 0, 0},
    };
    for (size_t n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        inv.leg[1] = cases[n].state;
        check_near("the low side's current (A)", leg_low_side_a(&inv, 1, cases[n].into_motor_a), cases[n].low_a, 0);
        check_equal("the terminal's rail", leg_level(&inv, 1), cases[n].level);
    }
    /* Both on: a node between two equal resistances to the rails, of which the phase takes 3 A. */
    inv.leg[1] = LEG_BOTH;
    double node_v = (inv.bus_v / 5e-3 - 3) / (2 / 5e-3);
    check_near("both on: through the lower switch (A)", leg_low_side_a(&inv, 1, 3), -node_v / 5e-3, 1e-9);
}

/* A plant with a locked rotor that carries some 6 A into A and half of it out of B and C (or the reverse), for as long
 * as all legs switch alike. */
static void start_with_current(struct plant *p, const struct plant_params *params, bool into_a)
{
    /* The ADC stays off: nobody would acknowledge its conversions. */
    const uint32_t a = into_a ? 4500 : 500, bc = into_a ? 500 : 4500;
    bench_start(p, params, (uint32_t[3]){a, bc, bc});
    motor_lock(&p->motor, true);
    bench_run(p, 10e-3);
    for (int k = 0; k < 3; k++) {
        bench_leg(p, k, 2500);
    }
    bench_run(p, 100e-6);
}

/* Little resistance, much inductance: the current stays when the legs switch alike. */
static struct plant_params lasting(double shunt)
{
    struct plant_params params = bench_plant();
    params.motor.resistance_ohm = 1e-3;
    params.motor.ld_h = params.motor.lq_h = 20e-3;
    params.inverter.supply_resistance_ohm = 0;
    params.inverter.diode_v = 0;
    params.sensors.shunt = shunt;
    return params;
}

static void check_phases(const char *name, struct plant *p, const bool seen[3])
{
    double codes[3];
    bench_run(p, 200e-6);
    struct plant_row row = bench_convert(p, codes);
    check_true("there is a current", fabs(row.i_a[1]) > 2);
    for (unsigned k = 0; k < 3; k++) {
        check_near(name, codes[k] * LSB_A, seen[k] ? row.i_a[k] : 0, seen[k] ? 0.6 * LSB_A : 0);
    }
}

/* Triggers where the low sides conduct, unless a leg is at 100 %. */
static void blind_at_full_duty(double shunt)
{
    struct plant_params params = lasting(shunt);
    struct plant p;
    start_with_current(&p, &params, true);
    check_phases("low sides on: each phase is seen", &p, (bool[3]){true, true, true});
    bench_compare(&p, 0, BENCH_PERIOD_COUNTS / 2);
    bench_leg(&p, 1, 4700);
    bench_leg(&p, 2, 4700);
    check_phases("100 %: no current in the shunt", &p, (bool[3]){shunt == 0, true, true});
}

/* The trigger moved into the dead time after the low sides, and into the one before them. */
static void dead_time(double shunt, bool into_a)
{
    static const uint32_t in_dead_time[2] = {1200, 3800};
    struct plant_params params = lasting(shunt);
    for (int n = 0; n < 2; n++) {
        struct plant p;
        start_with_current(&p, &params, into_a);
        bench_trigger_at(&p, in_dead_time[n]);
        bool lower_a = shunt == 0 || into_a, lower_bc = shunt == 0 || !into_a;
        check_phases("dead time: what the lower diodes carry", &p, (bool[3]){lower_a, lower_bc, lower_bc});
    }
}

/* Gates off: the current out of a leg comes through the lower diode, the current into one leaves through the upper. */
static void freewheeling(double shunt)
{
    struct plant_params params = lasting(shunt);
    struct plant p;
    start_with_current(&p, &params, true);
    bench_write(&p, GATE_CONTROL, 0);
    check_phases("gates off", &p, (bool[3]){true, shunt == 0, shunt == 0});
}

int main(void)
{
    each_state();
    for (int shunt = 0; shunt < 2; shunt++) {
        blind_at_full_duty(shunt);
        dead_time(shunt, true);
        dead_time(shunt, false);
        freewheeling(shunt);
    }
    return check_end();
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Plays a given sequence of switch states on bridge, supply, motor and shaft of a configuration, without a fabric, so that
 * another simulator can be given the same (qemu/launcher/motulator_check.py).
 *
 *   replay CONFIG < SEQUENCE
 *
 * A line of the sequence is "DURATION_S HIGH_SIDES LOAD_NM": bits 0 to 2 say whose high side is on, the others' low sides
 * are; LOAD_NM pulls at the shaft. Before each line it prints "t_s i_d_a i_q_a torque_nm speed load_speed bus_v". */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "config.h"

static struct config config;

struct replay {
    struct inverter inverter;
    struct motor motor;
    sim_ps now;
};

static unsigned gates_of(unsigned high_sides)
{
    unsigned gates = 0;
    for (int k = 0; k < 3; k++) {
        gates |= (high_sides >> k) & 1 ? GATE_HIGH(k) : GATE_LOW(k);
    }
    return gates;
}

static void play(struct replay *r, double duration_s, unsigned high_sides)
{
    sim_ps end = r->now + sim_from_s(duration_s);
    inverter_command(&r->inverter, gates_of(high_sides), r->now);
    while (r->now < end) {
        inverter_switch(&r->inverter, r->now);
        sim_ps next = inverter_next_switch(&r->inverter), to = next < end ? next : end;
        r->now = inverter_advance(&r->inverter, &r->motor, r->now, to);
    }
}

int main(int argc, char **argv)
{
    if (argc != 2) {
        fputs("mssfoc replay: usage: replay CONFIG < SEQUENCE\n", stderr);
        return 2;
    }
    config_load(&config, argv[1], true);
    struct replay r = {.now = 0};
    inverter_init(&r.inverter, &config.axis[0].plant.inverter);
    motor_init(&r.motor, &config.axis[0].plant.motor, &config.axis[0].plant.load);
    double duration_s, load_nm;
    unsigned high_sides;
    int fields;
    while ((fields = scanf("%lf %u %lf", &duration_s, &high_sides, &load_nm)) == 3) {
        const struct motor *m = &r.motor;
        printf("%.12g %.12g %.12g %.12g %.12g %.12g %.12g\n", sim_to_s(r.now), m->i_d_a, m->i_q_a, m->torque_nm,
               m->speed_rad_s, m->load_speed_rad_s, r.inverter.bus_v);
        r.motor.load_nm = load_nm;
        play(&r, duration_s, high_sides);
    }
    if (fields != EOF) {
        fputs("mssfoc replay: a line is not 'DURATION_S HIGH_SIDES LOAD_NM'\n", stderr);
        return 1;
    }
    return 0;
}

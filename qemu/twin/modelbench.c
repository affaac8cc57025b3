/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "modelbench.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

const struct motor_source open_terminals = {.held = {true, true, true}};

void report(const char *name, double value, const char *unit)
{
    printf("%s %.9g %s\n", name, value, unit);
}

void report_at(const char *name, const char *point, double value, const char *unit)
{
    printf("%s@%s %.9g %s\n", name, point, value, unit);
}

struct motor_params bench_params(const struct modelbench *b)
{
    struct motor_params p = b->motor;
    p.ambient_c = REFERENCE_C;
    p.winding_rise_k = 0;
    p.copper_tempco_per_k = 0;
    p.magnet_tempco_per_k = 0;
    return p;
}

struct motor bench_motor_at(const struct modelbench *b, double electrical_rad)
{
    struct motor_params p = bench_params(b);
    struct load_params no_load = {0};
    struct motor m;
    p.initial_angle_rad = electrical_rad / p.pole_pairs;
    motor_init(&m, &p, &no_load);
    return m;
}

struct motor_source phase_voltages(double a_v, double b_v, double c_v)
{
    return (struct motor_source){.emf_v = {a_v, b_v, c_v}};
}

struct motor_source two_terminals(double v)
{
    struct motor_source s = phase_voltages(v, 0, 0);
    s.held[2] = true;
    return s;
}

struct motor_source voltage_vector(double v, double angle_rad)
{
    return phase_voltages(v * cos(angle_rad), v * cos(angle_rad - 2 * PI / 3), v * cos(angle_rad + 2 * PI / 3));
}

double bench_step_s(const struct motor *m)
{
    double dt_s = motor_max_step_s(m, 0) / 10;
    return m->shaft == SHAFT_LOCKED ? dt_s : fmin(dt_s, 10e-6);
}

void run(struct motor *m, const struct motor_source *source, double duration_s)
{
    double left_s = duration_s;
    while (left_s > 1e-9 * duration_s) {
        double dt_s = fmin(left_s, bench_step_s(m));
        motor_step(m, source, dt_s);
        left_s -= dt_s;
    }
}

/* A long time without change, at steps a quarter as long as they may be: the path does not matter. */
void settle(struct motor *m, const struct motor_source *source)
{
    double before_a[3], now_a[3];
    motor_lock(m, true);
    for (int n = 0; n < 100000; n++) {
        motor_currents(m, before_a);
        for (int k = 0; k < 20; k++) {
            motor_step(m, source, motor_max_step_s(m, 0) / 4);
        }
        motor_currents(m, now_a);
        double change_a = fabs(now_a[0] - before_a[0]) + fabs(now_a[1] - before_a[1]) + fabs(now_a[2] - before_a[2]);
        if (change_a < 1e-9 * (1e-3 + fabs(now_a[0]) + fabs(now_a[1]) + fabs(now_a[2]))) {
            return;
        }
    }
    fputs("mssfoc modelcheck: the currents do not settle\n", stderr);
    exit(1);
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Hall switches: the six states, and where each signal changes. */
#include <math.h>

#include "bench.h"
#include "check.h"

#define PI 3.141592653589793

/* What the wires show after the shaft has come here. */
static unsigned state_at(struct hall *h, double electrical_rad)
{
    hall_follow(h, electrical_rad);
    return hall_wires(h);
}

static void six_states(void)
{
    static const unsigned order[6] = {5, 1, 3, 2, 6, 4}; /* A rises at 0, B at 120, C at 240 degrees */
    struct sensor_params p = {0};
    struct hall h;
    hall_init(&h, &p);
    for (int turn = -2; turn < 3; turn++) {
        for (int n = 0; n < 6; n++) {
            double middle_rad = 2 * PI * turn + (n + 0.5) * PI / 3;
            check_equal("state in the middle of a sixth", state_at(&h, middle_rad), order[n]);
        }
    }
}

/* The angle within from...to at which a signal changes, by halving. */
static double change_rad(struct hall *h, unsigned bit, double from, double to)
{
    unsigned start = state_at(h, from) & bit;
    check_true("it changes here", (state_at(h, to) & bit) != start);
    for (int n = 0; n < 50; n++) {
        double middle = (from + to) / 2;
        if ((state_at(h, middle) & bit) == start) {
            from = middle;
        } else {
            to = middle;
        }
    }
    return from;
}

static void placement(void)
{
    const struct sensor_params p = {
        .hall_angle_rad = 0.4, .hall_error_a_rad = 0.05, .hall_error_b_rad = -0.12, .hall_error_c_rad = 0.2};
    const double error_rad[3] = {0.05, -0.12, 0.2};
    struct hall h;
    hall_init(&h, &p);
    for (int k = 0; k < 3; k++) {
        double rise_rad = 0.4 + k * 2 * PI / 3 + error_rad[k];
        unsigned bit = 1u << k;
        check_near("rises (rad)", change_rad(&h, bit, rise_rad - 0.9, rise_rad + 1.1), rise_rad, 1e-9);
        check_near("falls half a turn later", change_rad(&h, bit, rise_rad + PI - 1, rise_rad + PI + 1.2),
                   rise_rad + PI, 1e-9);
        check_true("1 after the rise", state_at(&h, rise_rad + 0.01) & bit);
    }
}

/* Late by that, whichever way it turns; and the time since an edge counts from where it really was. */
static void hysteresis(void)
{
    const struct sensor_params p = {.hall_angle_rad = 0.4, .hall_error_b_rad = 0.1, .hall_hysteresis_rad = 0.05};
    struct hall h;
    hall_init(&h, &p);
    for (int way = -1; way <= 1; way += 2) {
        unsigned changes = 0;
        state_at(&h, 0.2 - way * 1.0);
        for (double rad = 0.2 - way * 1.0; fabs(rad - 0.2) < 8; rad += way * 1e-4) {
            if (hall_follow(&h, rad)) {
                double since = hall_since_rad(&h, rad, way > 0);
                double edge = rad - since - way * 0.05;
                double nearest = 9;
                for (int k = 0; k < 3; k++) {
                    double off = remainder(edge - 0.4 - k * 2 * PI / 3 - (k == 1 ? 0.1 : 0), PI);
                    nearest = fmin(nearest, fabs(off));
                }
                check_true("behind an edge, by less than the step", since * way >= 0 && fabs(since) <= 1.01e-4);
                check_near("late by the hysteresis", nearest, 0, 1e-9);
                changes++;
            }
        }
        check_true("six edges a turn", changes >= 7 && changes <= 9);
    }
    state_at(&h, 0.5);
    check_true("there and back within it: nothing", !hall_follow(&h, 0.36) && !hall_follow(&h, 0.44));
}

static void wires(void)
{
    struct sensor_params p = {0};
    struct hall h;
    hall_init(&h, &p);
    hall_swap_wires(&h, 0, 1);
    check_equal("A alone, on wire B", state_at(&h, PI / 2), 2);
    hall_swap_wires(&h, 0, 0);
    check_equal("and back", state_at(&h, PI / 2), 1);
    hall_invert_wire(&h, 2, true);
    check_equal("C the other way round", state_at(&h, PI / 2), 5);
    hall_open_wire(&h, 1, true);
    check_equal("B is pulled up", state_at(&h, PI / 2), 7);
    hall_open_wire(&h, 1, false);
    hall_invert_wire(&h, 2, false);
    check_equal("as it was", state_at(&h, PI / 2), 1);
}

static void keep_hall(void *context, const struct plant_row *row)
{
    *(unsigned *)context = row->hall;
}

/* In the row: of the electrical angle. */
static void of_the_electrical_angle(void)
{
    struct plant_params params = bench_plant();
    for (int n = 0; n < 24; n++) {
        struct plant p;
        unsigned got = 99;
        double electrical_rad = (n + 0.3) * 2 * PI / 6;
        params.motor.initial_angle_rad = electrical_rad / params.motor.pole_pairs;
        bench_start(&p, &params, (uint32_t[3]){2500, 2500, 2500});
        motor_lock(&p.motor, true);
        p.on_trigger = keep_hall;
        p.context = &got;
        bench_run(&p, 100e-6);
        unsigned expected = 0;
        for (int k = 0; k < 3; k++) {
            double after_rise = fmod(electrical_rad + 2 * PI - k * 2 * PI / 3, 2 * PI);
            expected |= after_rise < PI ? 1u << k : 0;
        }
        check_equal("row of a trigger", got, expected);
    }
}

int main(void)
{
    six_states();
    placement();
    hysteresis();
    wires();
    of_the_electrical_angle();
    return check_end();
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* ENC.EDGE_TIME and LATCH_TIME against docs/fabric.md: an edge's clock is when it passed, by the shaft's closed form, and the
 * two registers are of the last trigger. */
#include <math.h>

#include "bench.h"
#include "check.h"

#define PI       3.141592653589793
#define COUNTS   4000
#define CLOCK_PS SIM_PS_PER_FABRIC_CLOCK

static void start(struct plant *p, struct plant_params *params, double angle_rad)
{
    params->motor.initial_angle_rad = angle_rad;
    bench_before_trigger(p, params);
    bench_write(p, ENC_COUNTS, COUNTS);
    bench_write(p, ENC_CONTROL, 1);
}

static int64_t clock_of(sim_ps t)
{
    return (int64_t)floor((double)t / CLOCK_PS);
}

/* The trigger's clock, and EDGE_TIME against when the last edge before it passed at constant speed. */
static void at_speed(double speed_rad_s, double start_rad)
{
    struct plant_params params = bench_plant();
    struct plant p;
    int64_t wrong_latch = 0, wrong_edge = 0, edges = 0;
    start(&p, &params, start_rad);
    motor_spin(&p.motor, speed_rad_s);
    sim_ps from = p.now;
    for (int n = 0; n < 200; n++) {
        sim_ps trigger = plant_next_trigger(&p);
        plant_advance(&p, trigger + sim_from_s(10e-6));
        double at_trigger_rad = start_rad + speed_rad_s * sim_to_s(trigger - from), edge_rad = 2 * PI / COUNTS;
        double passed_rad =
            (speed_rad_s > 0 ? floor(at_trigger_rad / edge_rad) : ceil(at_trigger_rad / edge_rad)) * edge_rad;
        double since_s = (at_trigger_rad - passed_rad) / speed_rad_s;
        wrong_latch += bench_read(&p, ENC_LATCH_TIME) != clock_of(trigger);
        if (trigger - sim_from_s(since_s) > from) {
            int64_t error = (int64_t)bench_read(&p, ENC_EDGE_TIME) - clock_of(trigger - sim_from_s(since_s));
            wrong_edge += error < -1 || error > 1;
            edges++;
        }
    }
    check_equal("LATCH_TIME is the trigger's clock", wrong_latch, 0);
    check_true("edges passed", edges > 20);
    check_equal("EDGE_TIME is when the last edge passed, to a clock", wrong_edge, 0);
}

/* A free shaft that a constant torque speeds up from rest: the n-th edge comes after sqrt(2 n edge / a). */
static void from_rest(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    start(&p, &params, 1e-9);
    bench_write(&p, GATE_CONTROL, 0);
    bench_run(&p, 20e-3); /* no current is left */
    p.motor.theta_rad = 1e-9;
    p.motor.speed_rad_s = 0;
    motor_lock(&p.motor, true);
    bench_run(&p, 1e-6);
    motor_release(&p.motor);
    p.motor.load_nm = -20e-3;
    double a = 20e-3 / params.motor.inertia_kgm2, edge_rad = 2 * PI / COUNTS;
    sim_ps from = p.now;
    uint32_t seen = bench_read(&p, ENC_EDGE_TIME);
    int64_t checked = 0, worst = 0, base = bench_read(&p, ENC_POSITION);
    for (int n = 0; n < 400; n++) {
        plant_advance(&p, plant_next_trigger(&p) + sim_from_s(10e-6));
        uint32_t clock = bench_read(&p, ENC_EDGE_TIME);
        if (clock != seen) {
            int64_t edge = (int64_t)bench_read(&p, ENC_LATCHED) - base;
            double since_s = sqrt(2 * (edge * edge_rad - 1e-9) / a);
            int64_t error = (int64_t)clock - clock_of(from + sim_from_s(since_s));
            worst = error * error > worst * worst ? error : worst;
            checked++;
            seen = clock;
        }
    }
    check_true("edges of an accelerating shaft", checked > 50);
    check_near("EDGE_TIME while it speeds up, clocks", (double)worst, 0, 5);
}

static void what_is_not_counted(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    start(&p, &params, 0);
    motor_spin(&p.motor, 200);
    bench_run(&p, 1e-3);
    uint32_t last = bench_read(&p, ENC_EDGE_TIME), latch = bench_read(&p, ENC_LATCH_TIME);
    check_true("edges are timed", last != 0 && latch - last < 100000);
    encoder_freeze(&p.model.encoder, true);
    bench_run(&p, 1e-3);
    uint32_t frozen = bench_read(&p, ENC_EDGE_TIME);
    bench_run(&p, 1e-3);
    check_equal("a frozen encoder has no further edges", bench_read(&p, ENC_EDGE_TIME), frozen);
    check_equal("but time goes on: 2 ms", bench_read(&p, ENC_LATCH_TIME) - latch, 200000);
    encoder_freeze(&p.model.encoder, false);
    bench_run(&p, 1e-3);
    check_true("and edges come again", bench_read(&p, ENC_EDGE_TIME) - frozen > 100000);
    bench_write(&p, ENC_CONTROL, 0);
    bench_run(&p, 60e-6);
    uint32_t stopped = bench_read(&p, ENC_EDGE_TIME);
    bench_run(&p, 1e-3);
    check_equal("nor has a counter that is off", bench_read(&p, ENC_EDGE_TIME), stopped);
    bench_write(&p, ENC_EDGE_TIME, 1);
    check_equal("read-only", bench_read(&p, ENC_EDGE_TIME), stopped);
}

/* Between triggers the registers keep still, whatever passes. */
static void of_the_trigger(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    start(&p, &params, 0);
    motor_spin(&p.motor, 500); /* an edge every 3.1 us */
    plant_advance(&p, plant_next_trigger(&p) + 1);
    uint32_t edge = bench_read(&p, ENC_EDGE_TIME), latched = bench_read(&p, ENC_LATCHED);
    bench_run(&p, 30e-6);
    check_true("the count goes on", bench_read(&p, ENC_POSITION) > latched + 5);
    check_equal("EDGE_TIME stays", bench_read(&p, ENC_EDGE_TIME), edge);
    bench_run(&p, 30e-6);
    check_true("until the next trigger", bench_read(&p, ENC_EDGE_TIME) != edge);
    plant_reset_fabric(&p);
    check_equal("reset", bench_read(&p, ENC_EDGE_TIME) | bench_read(&p, ENC_LATCH_TIME), 0);
}

int main(void)
{
    at_speed(500, 0.1);
    at_speed(-500, 0.1);
    at_speed(30, 1.0);
    at_speed(-31, 1.0);
    from_rest();
    what_is_not_counted();
    of_the_trigger();
    return check_end();
}

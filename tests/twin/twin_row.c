/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Values of a period in the recorder's row: effective values, peaks and mean torque with their ripple. */
#include <math.h>

#include "bench.h"
#include "check.h"

#define PI 3.141592653589793

static struct plant_row last_row;

static void keep_row(void *context, const struct plant_row *row)
{
    (void)context;
    last_row = *row;
}

/* Legs that switch without dead time on a stiff bus: A on from count 0 for on_counts, B and C low. The locked rotor's
 * current along A then goes up and down between two voltages, exponentially. Left-aligned, so that the trigger finds the
 * valley and no mean. */
struct ripple {
    double r_ohm, l_h, v_v, on_s, off_s;
    double valley_a, crest_a; /* when it repeats */
};

static struct ripple ripple_of(const struct plant_params *params, uint32_t on_counts)
{
    struct ripple r = {.r_ohm = params->motor.resistance_ohm + params->inverter.r_on_ohm,
                       .l_h = params->motor.ld_h,
                       .v_v = 2.0 / 3 * params->inverter.vbus_v,
                       .on_s = on_counts * 10e-9};
    r.off_s = 50e-6 - r.on_s;
    double up = exp(-r.on_s * r.r_ohm / r.l_h), down = exp(-r.off_s * r.r_ohm / r.l_h), end_a = r.v_v / r.r_ohm;
    r.crest_a = end_a * (1 - up) / (1 - up * down);
    r.valley_a = r.crest_a * down;
    return r;
}

/* Mean of f(i) over a period, by the midpoint rule. */
static double mean_of(const struct ripple *r, double (*f)(double))
{
    const int samples = 200000;
    double sum = 0;
    for (int n = 0; n < samples; n++) {
        double t = 50e-6 * (n + 0.5) / samples, end_a = t < r->on_s ? r->v_v / r->r_ohm : 0;
        double from_a = t < r->on_s ? r->valley_a : r->crest_a, since_s = t < r->on_s ? t : t - r->on_s;
        sum += f(end_a + (from_a - end_a) * exp(-since_s * r->r_ohm / r->l_h));
    }
    return sum / samples;
}

static double square(double i_a)
{
    return i_a * i_a;
}

static double itself(double i_a)
{
    return i_a;
}

/* On for an odd number of counts, with a dead time of one, from the trigger on; the other phases stay low. */
static void start_ripple(struct plant *p, const struct plant_params *params, uint32_t on_counts)
{
    const uint32_t compare = (on_counts + 1) / 2;
    bench_start(p, params, (uint32_t[3]){2500, 2500, 2500});
    motor_lock(&p->motor, true);
    bench_write(p, PWM_CONTROL, 0);
    bench_run(p, 1e-6);
    bench_write(p, PWM_DEAD, 1);
    bench_compare(p, 0, compare);
    bench_compare(p, 1, 0);
    bench_compare(p, 2, 0);
    bench_write(p, PWM_TRIGGER_1, (compare - 1) | 1u << 16);
    bench_write(p, PWM_CONTROL, 1);
    p->on_trigger = keep_row;
    bench_run(p, 6e-3);
}

static struct plant_params rippling(double electrical_rad)
{
    struct plant_params params = bench_plant();
    params.motor.ld_h = params.motor.lq_h = 60e-6;
    params.motor.initial_angle_rad = electrical_rad / params.motor.pole_pairs;
    params.inverter.supply_resistance_ohm = 0;
    params.inverter.diode_v = 0;
    return params;
}

static void currents_with_their_ripple(uint32_t on_counts)
{
    struct plant_params params = rippling(0);
    struct ripple r = ripple_of(&params, on_counts);
    struct plant p;
    start_ripple(&p, &params, on_counts);
    double rms_a = sqrt(mean_of(&r, square));
    check_near("the trigger finds the valley (A)", last_row.i_a[0], r.valley_a, 1e-3 * r.crest_a);
    check_near("effective value of A", last_row.i_rms_a[0], rms_a, 1e-3 * rms_a);
    check_near("half of it in B", last_row.i_rms_a[1], rms_a / 2, 1e-3 * rms_a);
    check_near("half of it in C", last_row.i_rms_a[2], rms_a / 2, 1e-3 * rms_a);
    check_true("which neither valley nor crest is", rms_a > 1.05 * r.valley_a && rms_a < 0.98 * r.crest_a);
    check_near("peak of A", last_row.i_peak_a[0], r.crest_a, 1e-3 * r.crest_a);
    check_near("peak of B, whatever its sign", last_row.i_peak_a[1], r.crest_a / 2, 1e-3 * r.crest_a);
    bench_write(&p, GATE_CONTROL, 0);
    bench_run(&p, 1e-3);
    check_near("nothing of the periods before", last_row.i_rms_a[0] + last_row.i_peak_a[0], 0, 1e-9);
}

/* T = 3/2 p psi i_q, i_q = -i sin(angle): linear in the current, so its mean is that of the mean current. */
static void mean_torque(void)
{
    const double angle_rad = -1.1;
    struct plant_params params = rippling(angle_rad);
    struct ripple r = ripple_of(&params, 1001);
    struct plant p;
    start_ripple(&p, &params, 1001);
    double nm_per_a = -1.5 * 4 * 7.5e-3 * sin(angle_rad);
    double expected_nm = nm_per_a * mean_of(&r, itself);
    check_near("torque at the trigger (Nm)", last_row.torque_nm, nm_per_a * r.valley_a, 1e-3 * expected_nm);
    check_near("mean torque", last_row.torque_mean_nm, expected_nm, 1e-3 * expected_nm);
    check_true("which differ", last_row.torque_mean_nm > 1.05 * last_row.torque_nm);
}

/* Of the legs, not of the motor: two joined terminals draw a current that never reaches it. */
static void current_of_the_legs(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    params.inverter.supply_resistance_ohm = 0;
    bench_start(&p, &params, (uint32_t[3]){4000, 1000, 1000});
    motor_lock(&p.motor, true);
    inverter_short(&p.inverter, 0, 1, 10);
    p.on_trigger = keep_row;
    bench_run(&p, 60e-6);
    bench_run(&p, 50e-6);
    double through_short_a = 24 / 10.0, motor_a = fabs(last_row.i_a[0]);
    check_near("peak of A: the motor's and the short's", last_row.i_peak_a[0], motor_a + through_short_a, 0.2);
    check_true("more than the motor's", last_row.i_peak_a[0] > motor_a + 1);
}

static void shaft_and_magnets(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    bench_start(&p, &params, (uint32_t[3]){2500, 2500, 2500});
    motor_spin(&p.motor, 33);
    p.on_trigger = keep_row;
    bench_run(&p, 200e-6);
    check_near("the load turns with the motor (rad/s)", last_row.load_speed_rad_s, 33, 1e-9);
    check_near("magnets at ambient (C)", last_row.magnet_c, 25, 1e-3);
}

/* The meter alone: pieces of which the integral is known, and the moment when no time has passed. */
static void pieces(void)
{
    struct meter m = {0};
    struct meter_reading r;
    meter_add(&m, 2, (double[3]){0, 1, -3}, (double[3]){6, 1, 3}, 4);
    meter_read(&m, &r);
    check_near("a ramp from 0: peak / sqrt 3", r.i_rms_a[0], 6 / sqrt(3), 1e-12);
    check_near("a constant", r.i_rms_a[1], 1, 1e-12);
    check_near("through zero", r.i_rms_a[2], 3 / sqrt(3), 1e-12);
    check_near("peak", r.i_peak_a[2], 3, 0);
    check_near("torque from 0 to 4", r.torque_mean_nm, 2, 1e-12);
    meter_read(&m, &r);
    check_near("without time: the last current", r.i_rms_a[0], 6, 0);
    check_near("and torque", r.torque_mean_nm, 4, 0);
    meter_add(&m, 1, (double[3]){1, -2, 0}, (double[3]){1, 0, 0}, 4);
    meter_read(&m, &r);
    check_near("each reading starts anew", r.i_peak_a[0] + r.i_rms_a[0], 2, 1e-12);
    check_near("a peak where the piece begins", r.i_peak_a[1], 2, 0);
}

int main(void)
{
    currents_with_their_ripple(1001);
    currents_with_their_ripple(2701);
    mean_torque();
    current_of_the_legs();
    shaft_and_magnets();
    pieces();
    return check_end();
}

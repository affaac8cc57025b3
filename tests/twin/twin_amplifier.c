/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The amplifiers: low pass, settling after the low side turns on, ringing and noise after edges. */
#include <math.h>

#include "bench.h"
#include "check.h"

#define PI        3.141592653589793
#define NO_TIME_S 1e-15

/* y' = (u - y) / lag by many small steps of the classical Runge-Kutta method, u linear. */
static double integrated(double y, double from, double to, double dt_s, double lag_s)
{
    const int steps = 200;
    double h = dt_s / steps, slope = (to - from) / dt_s;
    for (int n = 0; n < steps; n++) {
        double u0 = from + slope * h * n, um = u0 + slope * h / 2, u1 = u0 + slope * h;
        double k1 = (u0 - y) / lag_s, k2 = (um - y - h / 2 * k1) / lag_s;
        double k3 = (um - y - h / 2 * k2) / lag_s, k4 = (u1 - y - h * k3) / lag_s;
        y += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    }
    return y;
}

static void low_pass_of_any_pieces(void)
{
    const double lag_s = 0.3e-6;
    struct amplifier a;
    amplifier_init(&a);
    double y = 0, worst = 0;
    for (int n = 0; n < 2000; n++) {
        struct leg_view leg = {any_real(-20, 20), any_real(-20, 20), any_between(-1, 1)};
        double dt_s = any_real(1e-9, 3e-6);
        y = integrated(y, leg.from_a, leg.to_a, dt_s, lag_s);
        amplifier_follow(&a, &leg, dt_s, lag_s, exp(-dt_s / lag_s));
        worst = fmax(worst, fabs(a.out_a - y));
    }
    check_near("low pass: error against small steps (A)", worst, 0, 1e-6);
    check_true("low pass: it has moved", fabs(y) > 0.1);
}

/* Events may come so close to each other that rounding leaves nothing between them, or a denormal number. */
static void no_time_at_all(void)
{
    const double lag_s = 0.3e-6, none_s[] = {0, 1e-320, 1e-18};
    struct amplifier a;
    amplifier_init(&a);
    struct leg_view steady = {3, 3, 1};
    amplifier_follow(&a, &steady, 1e-3, lag_s, exp(-1e-3 / lag_s));
    for (int n = 0; n < 3; n++) {
        struct leg_view leg = {3, 3 + 1e-9 * n, 1};
        amplifier_follow(&a, &leg, none_s[n], lag_s, exp(-none_s[n] / lag_s));
        check_near("a step without a length: as before (A)", a.out_a, 3, 1e-12);
    }
}

/* A plant whose locked rotor carries a nearly constant current, all legs at half: the low sides turn on at count 3850, the
 * high sides off at 3750. Into the motor the current comes through the lower diode from then on, out of the motor only
 * when the switch is on. */
static struct plant_params settling_params(double amp_hz)
{
    struct plant_params params = bench_plant();
    params.motor.resistance_ohm = 1e-3;
    params.motor.ld_h = params.motor.lq_h = 20e-3;
    params.inverter.supply_resistance_ohm = 0;
    params.inverter.diode_v = 0;
    params.sensors.shunt = 1;
    params.sensors.amp_hz = amp_hz;
    params.sensors.i_range_a = 10;
    return params;
}

static void start_settled(struct plant *p, const struct plant_params *params)
{
    bench_start(p, params, (uint32_t[3]){4500, 500, 500});
    motor_lock(&p->motor, true);
    bench_run(p, 10e-3);
    for (int k = 0; k < 3; k++) {
        bench_leg(p, k, 2500);
    }
    bench_run(p, 100e-6);
}

/* At another count of the period. */
static struct plant_row convert_at(struct plant *p, uint32_t count, double codes[3])
{
    bench_trigger_at(p, count);
    bench_run(p, 150e-6);
    return bench_convert(p, codes);
}

static void settling_after_the_edge(void)
{
    const double amp_hz = 300e3, lsb_a = 10.0 / 2048;
    struct plant_params params = settling_params(amp_hz);
    struct plant p;
    struct plant_row row;
    double codes[3];
    start_settled(&p, &params);
    for (uint32_t after = 10; after < 400; after += 37) {
        double diode_s = (after + 100) * 10e-9, switch_s = after * 10e-9;
        row = convert_at(&p, 3850 + after, codes);
        check_true("a current to settle to", row.i_a[0] > 5);
        check_near("settles from the diode on (A)", codes[0] * lsb_a,
                   row.i_a[0] * (1 - exp(-2 * PI * amp_hz * diode_s)), 0.6 * lsb_a);
        check_near("settles from the switch on (A)", codes[1] * lsb_a,
                   row.i_a[1] * (1 - exp(-2 * PI * amp_hz * switch_s)), 0.6 * lsb_a);
    }
    /* Off for t: what is left of the current that the shunt had. */
    row = convert_at(&p, 1150 + 30, codes);
    check_near("decays after the switch is off (A)", codes[1] * lsb_a, row.i_a[1] * exp(-2 * PI * amp_hz * 0.3e-6),
               0.6 * lsb_a);
    params = settling_params(0);
    start_settled(&p, &params);
    row = convert_at(&p, 3850 + 10, codes);
    check_near("ideal: settled at once", codes[1] * lsb_a, row.i_a[1], 0.6 * lsb_a);
}

/* In line, the low pass follows the staircase of a rising current: A leads B and C by 15 us on either side of the middle
 * of the period, less the dead time, in which the current out of B and C takes their terminals up at once. */
static void in_line_staircase(void)
{
    const double amp_hz = 20e3, lag_s = 1 / (2 * PI * amp_hz), step_a = 2.0 / 3 * 24 / 1e-3 * 14e-6;
    struct plant_params params = settling_params(amp_hz);
    struct plant p;
    double codes[3], i = 0, y = 0;
    params.sensors.shunt = 0;
    params.inverter.r_on_ohm = params.motor.resistance_ohm = 1e-4;
    params.motor.ld_h = params.motor.lq_h = 1e-3;
    bench_start(&p, &params, (uint32_t[3]){4000, 1000, 1000});
    motor_lock(&p.motor, true);
    bench_run(&p, 0.9e-3);
    struct plant_row row = bench_convert(&p, codes);
    for (int period = 0; period < 18; period++) {
        y = integrated(y, i, i, 5e-6, lag_s);
        y = integrated(y, i, i + step_a, 14e-6, lag_s);
        y = integrated(y, i + step_a, i + step_a, 12e-6, lag_s);
        y = integrated(y, i + step_a, i + 2 * step_a, 14e-6, lag_s);
        i += 2 * step_a;
        y = integrated(y, i, i, 5e-6, lag_s);
    }
    check_between("in line: there is a lag (A)", i - y, 0.03, 0.2);
    check_near("in line: lag of the measured current (A)", row.i_a[0] - codes[0] * 10.0 / 2048, i - y,
               0.6 * 10.0 / 2048);
}

/* ---- after edges ---- */

static const struct sensor_params ringing = {
    .i_range_a = 20.48,
    .v_range_v = 40.96,
    .adc_bits = 12,
    .i_gain_a = 1,
    .i_gain_b = 1,
    .i_gain_c = 1,
    .ring_lsb = 200,
    .ring_hz = 3e6,
    .ring_tau_s = 0.4e-6,
    .encoder_counts = 4000,
    .encoder_index_counts = 1,
};

static void follow(struct sensors *s, int level_a, int level_b, double dt_s)
{
    struct leg_view leg[3] = {{1, 1, level_a}, {1, 1, level_b}, {1, 1, -1}};
    sensors_follow(s, leg, dt_s);
}

static double lsb_of(struct sensors *s, int k)
{
    return (double)sensors_current_code(s, k, 0, 1) - 2048 - 100;
}

static void rings_after_its_own_edges(void)
{
    struct sensors s;
    sensors_init(&s, &ringing, 1);
    check_true("edges matter", s.follows);
    follow(&s, 1, 1, NO_TIME_S);
    check_near("the first level is no edge", lsb_of(&s, 0), 0, 0.5);
    follow(&s, 1, 1, 1e-3);
    follow(&s, -1, 1, NO_TIME_S);
    check_near("at the edge: all of it", lsb_of(&s, 0), 200, 0.5);
    for (int n = 1; n < 40; n++) {
        double t = 23e-9 * n;
        follow(&s, -1, 1, 23e-9);
        check_near("ringing", lsb_of(&s, 0), 200 * exp(-t / 0.4e-6) * cos(2 * PI * 3e6 * t), 0.51);
        check_near("not of another leg's edge", lsb_of(&s, 1), 0, 0.5);
    }
    follow(&s, 0, 1, 1e-3);
    follow(&s, -1, 1, NO_TIME_S);
    check_near("back to the same rail: no edge", lsb_of(&s, 0), 0, 0.5);
    follow(&s, 0, 1, 1e-3);
    follow(&s, 1, 1, NO_TIME_S);
    check_near("to the other, with a pause between: an edge", lsb_of(&s, 0), 200, 0.5);
}

/* The deviation of many draws, t after an edge of another leg. */
static double edge_noise_after(double t_s)
{
    struct sensor_params p = ringing;
    struct sensors s;
    const int count = 20000;
    double square = 0;
    p.ring_lsb = 0;
    p.edge_noise_lsb = 100;
    p.edge_noise_tau_s = 1e-6;
    sensors_init(&s, &p, 9);
    check_true("edges matter for the noise", s.follows);
    follow(&s, 1, 1, 1e-3);
    follow(&s, 1, -1, t_s + NO_TIME_S);
    for (int n = 0; n < count; n++) {
        sensors_draw_noise(&s);
        double d = lsb_of(&s, 0);
        square += d * d;
    }
    return sqrt(square / count);
}

static void noise_of_any_edge(void)
{
    for (int n = 0; n < 4; n++) {
        double t_s = 0.7e-6 * n, expected = hypot(100 * exp(-0.7 * n), sqrt(1.0 / 12));
        check_near("edge noise: deviation (LSB)", edge_noise_after(t_s), expected, 4 * expected / sqrt(2.0 * 20000));
    }
}

/* The sequence of a source is its own: other sources add to a code and do not shift it. */
static void streams(void)
{
    struct sensor_params plain = ringing, noisy;
    struct sensors a, b;
    struct random alone;
    plain.ring_lsb = 0;
    plain.i_noise_lsb = plain.v_noise_lsb = 10;
    noisy = plain;
    noisy.edge_noise_lsb = 100;
    noisy.edge_noise_tau_s = 1e-6;
    noisy.encoder_lost_per_rev = noisy.encoder_extra_per_rev = 50;
    sensors_init(&a, &plain, 77);
    sensors_init(&b, &noisy, 77);
    random_seed(&alone, 77);
    int shifted = 0, differ_at_edge = 0, off_sequence = 0;
    for (int n = 0; n < 1000; n++) {
        double expected[4];
        for (int k = 0; k < 4; k++) {
            expected[k] = floor(k < 3 ? 2148.5 + 10 * random_gaussian(&alone) : 2400.5 + 10 * random_gaussian(&alone));
        }
        sensors_draw_noise(&a);
        sensors_draw_noise(&b);
        disc_miscounts(&b.disc, 100);
        follow(&b, n % 2 ? 1 : -1, 1, n % 3 ? 1e-3 : 1e-7);
        for (int k = 0; k < 3; k++) {
            uint32_t code = sensors_current_code(&a, k, 0, 1);
            bool other = sensors_current_code(&b, k, 0, 1) != code;
            shifted += n % 3 && other;
            differ_at_edge += !(n % 3) && other;
            off_sequence += code != (uint32_t)expected[k];
        }
        off_sequence += sensors_bus_code(&a, 24) != (uint32_t)expected[3];
    }
    check_equal("codes off the seed's own sequence", off_sequence, 0);
    check_equal("codes long after an edge that other sources changed", shifted, 0);
    check_true("codes right after one differ", differ_at_edge > 900);
}

int main(void)
{
    low_pass_of_any_pieces();
    no_time_at_all();
    settling_after_the_edge();
    in_line_staircase();
    rings_after_its_own_edges();
    noise_of_any_edge();
    streams();
    return check_end();
}

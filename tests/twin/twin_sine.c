/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A sine among the measured currents: its amplitude, phase and direction as the three codes show them, and what the
 * amplifiers make of it. */
#include <math.h>
#include <string.h>

#include "bench.h"
#include "check.h"
#include "events.h"

#define PI 3.141592653589793

/* One code is 10 mA. */
static struct sensor_params plain(double amp_hz)
{
    return (struct sensor_params){
        .i_range_a = 20.48,
        .v_range_v = 40.96,
        .adc_bits = 12,
        .i_gain_a = 1,
        .i_gain_b = 1,
        .i_gain_c = 1,
        .amp_hz = amp_hz,
        .encoder_counts = 4000,
        .encoder_index_counts = 1,
    };
}

static void codes_at(const struct sensors *s, double t_s, double codes[3])
{
    for (int k = 0; k < 3; k++) {
        codes[k] = (double)sensors_current_code(s, k, t_s, 0) - 2048;
    }
}

static void direction_and_phase(void)
{
    struct sensor_params p = plain(0);
    struct sensors s;
    sensors_init(&s, &p, 1);
    for (double angle = -3; angle < 3.2; angle += 0.7) {
        sensors_inject(&s, 6, 400, angle, 0.25);
        for (double t = 0.25; t < 0.2525; t += 0.31e-3) {
            double codes[3], along = 600 * sin(2 * PI * 400 * (t - 0.25));
            codes_at(&s, t, codes);
            check_near("A", codes[0], along * cos(angle), 0.51);
            check_near("B", codes[1], along * cos(angle - 2 * PI / 3), 0.51);
            check_near("C", codes[2], along * cos(angle + 2 * PI / 3), 0.51);
        }
    }
    double codes[3];
    sensors_inject(&s, 0, 0, 0, 0.26);
    codes_at(&s, 0.261, codes);
    check_near("the end of it", fabs(codes[0]) + fabs(codes[1]) + fabs(codes[2]), 0, 0);
}

/* Gain and stuck code act on it as on any current. */
static void beside_the_other_faults(void)
{
    struct sensor_params p = plain(0);
    struct sensors s;
    double codes[3];
    p.i_gain_b = 0.5;
    sensors_init(&s, &p, 1);
    s.current[0].add_a = 1;
    s.current[2].stuck_code = 2000;
    sensors_inject(&s, 8, 1000, 0, 0);
    codes_at(&s, 0.25e-3, codes);
    check_near("added to what is added", codes[0], 900, 0.5);
    check_near("through the gain", codes[1], -200, 0.5);
    check_near("not where the code is stuck", codes[2], -48, 0);
}

/* y' = (u - y) / lag from rest, by small steps. */
static void through_the_low_pass(void)
{
    const double lag_s = 1 / (2 * PI * 5e3), h = 1e-7;
    struct sensor_params p = plain(5e3);
    struct sensors s;
    double y = 0, worst = 0;
    sensors_init(&s, &p, 1);
    sensors_inject(&s, 10, 2000, 0, 0);
    for (int n = 0; n < 20000; n++) {
        double codes[3], u0 = 10 * sin(2 * PI * 2000 * n * h), u1 = 10 * sin(2 * PI * 2000 * (n + 1) * h);
        y += h / lag_s * ((u0 + u1) / 2 - y) * (1 - h / lag_s / 2);
        codes_at(&s, (n + 1) * h, codes);
        worst = fmax(worst, fabs(codes[0] * 0.01 - y));
    }
    check_near("the amplifier's answer, from its start (A)", worst, 0, 0.006);
}

/* In the plant, with the phases blind: a shunt's amplifier is given it all the same. */
static void in_the_plant(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    params.sensors.shunt = 1;
    bench_start(&p, &params, (uint32_t[3]){2500, 2500, 2500});
    bench_write(&p, GATE_CONTROL, 0);
    bench_run(&p, 1e-3);
    sensors_inject(&p.sensors, 5, 700, 1, 1e-3);
    for (int n = 0; n < 20; n++) {
        double codes[3];
        struct plant_row row = bench_convert(&p, codes);
        double along_lsb = 5 * 2048 / 25.0 * sin(2 * PI * 700 * (row.t_s - 1e-3));
        check_near("at the trigger's time (LSB)", codes[0], along_lsb * cos(1), 0.51);
        check_near("of each phase", codes[1], along_lsb * cos(1 - 2 * PI / 3), 0.51);
        bench_run(&p, 20e-6);
    }
}

static void as_an_event(void)
{
    struct event e;
    check_true("the event is known",
               event_parse("sensor_sine 1.5 320 -0.5", &e) == NULL && e.kind == EVENT_SENSOR_SINE);
    check_near("amplitude", e.number, 1.5, 0);
    check_near("frequency", e.second, 320, 0);
    check_near("direction", e.third, -0.5, 0);
    check_true("two numbers are not enough", event_parse("sensor_sine 1.5 320", &e) != NULL);
    check_true("four are too many", event_parse("sensor_sine 1.5 320 0 0", &e) != NULL);
    check_true("a word is none", event_parse("sensor_sine 1.5 x 0", &e) != NULL);
}

int main(void)
{
    as_an_event();
    direction_and_phase();
    beside_the_other_faults();
    through_the_low_pass();
    in_the_plant();
    return check_end();
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* ADC.TEMP against docs/fabric.md, and the sensor behind it against its closed form. */
#include "thermometer.h"

#include <math.h>

#include "bench.h"
#include "check.h"

static struct motor_params fitted(double offset_k)
{
    struct motor_params p = bench_motor;
    p.temperature_sensor = 1;
    p.temperature_offset_k = offset_k;
    p.temperature_lag_s = 2;
    return p;
}

static void codes(void)
{
    struct motor_params p = fitted(0), bare = bench_motor;
    struct thermometer t;
    thermometer_init(&t, &p, 0);
    check_equal("0 degC", thermometer_code(&t), 800);
    thermometer_init(&t, &p, 100);
    check_equal("100 degC", thermometer_code(&t), 2400);
    thermometer_init(&t, &p, 100.04);
    check_equal("to the nearest sixteenth", thermometer_code(&t), 2401);
    thermometer_init(&t, &p, -80);
    check_equal("a sensor in the cold does not look like none", thermometer_code(&t), 1);
    thermometer_init(&t, &p, 400);
    check_equal("nor does the code go beyond 12 bits", thermometer_code(&t), 4095);
    p = fitted(-3);
    thermometer_init(&t, &p, 100);
    check_equal("3 K low", thermometer_code(&t), 2400 - 48);
    bare.temperature_sensor = 0;
    thermometer_init(&t, &bare, 100);
    check_equal("none", thermometer_code(&t), 0);
    thermometer_hold(&t, 150);
    check_equal("made to show", thermometer_code(&t), 3200);
    thermometer_let_go(&t);
    check_equal("and let go", thermometer_code(&t), 0);
}

static void lag(void)
{
    struct motor_params p = fitted(0);
    struct thermometer t;
    thermometer_init(&t, &p, 20);
    for (int n = 1; n <= 40000; n++) {
        thermometer_follow(&t, 120, n * BENCH_PERIOD_PS);
    }
    check_near("a step of 100 K, after one lag", t.shown_c, 120 - 100 * exp(-1), 1e-6);
    thermometer_follow(&t, 120, 40000 * BENCH_PERIOD_PS + sim_from_s(2));
    check_near("whatever the steps", t.shown_c, 120 - 100 * exp(-2), 1e-6);
}

static void in_the_plant(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    params.motor = fitted(0);
    params.motor.ambient_c = 40;
    params.motor.winding_rise_k = 20;
    bench_before_trigger(&p, &params);
    bench_write(&p, ADC_CONTROL, 1);
    check_equal("TEMP before a conversion", bench_read(&p, ADC_TEMP), 0);
    bench_run(&p, 2e-6); /* the trigger was 1 us ago, the end is 1.5 us after it */
    check_equal("during it", bench_read(&p, ADC_TEMP), 0);
    bench_run(&p, 1e-6);
    check_equal("it follows the conversion", bench_read(&p, ADC_TEMP), 0);
    bench_run(&p, 50e-6);
    check_near("and shows with the next one's results", bench_read(&p, ADC_TEMP), 800 + 60 * 16, 1);
    bench_write(&p, ADC_TEMP, 5);
    check_near("read-only", bench_read(&p, ADC_TEMP), 800 + 60 * 16, 1);
    p.motor.winding_c = 160;
    bench_run(&p, 0.1);
    double expected_c = 160 - 100 * exp(-0.05);
    check_near("follows the winding", bench_read(&p, ADC_TEMP), 800 + 16 * expected_c, 2);
    plant_reset_fabric(&p);
    check_equal("reset", bench_read(&p, ADC_TEMP), 0);
    check_near("which the sensor does not notice", p.thermometer.shown_c, expected_c, 0.1);
}

int main(void)
{
    codes();
    lag();
    in_the_plant();
    return check_end();
}

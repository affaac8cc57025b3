/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Phases sampled one after the other, and a calibration that ages. */
#include <math.h>

#include "bench.h"
#include "check.h"

/* A alone at the supply while the trigger comes: a current that rises by 2/3 24 V / 30 uH in A, by minus half of that in B
 * and C, which would be equal if all were sampled at once. */
static const double rise_a_s = 2.0 / 3 * 24 / 30e-6, lsb_a = 25.0 / 2048;

static void start_on_a_slope(struct plant *p, double skew_b_s, double skew_c_s)
{
    struct plant_params params = bench_plant();
    params.motor.ld_h = params.motor.lq_h = 30e-6;
    params.motor.resistance_ohm = params.inverter.r_on_ohm = 1e-4;
    params.inverter.supply_resistance_ohm = 0;
    params.sensors.skew_b_s = skew_b_s;
    params.sensors.skew_c_s = skew_c_s;
    bench_start(p, &params, (uint32_t[3]){1000, 200, 200});
    motor_lock(&p->motor, true);
    bench_trigger_at(p, 2100);
    bench_run(p, 70e-6);
}

static void samples_one_after_the_other(void)
{
    static const double skews_s[][2] = {{0, 0}, {0.6e-6, 0}, {0, 1.2e-6}, {0.4e-6, 0.8e-6}, {0.5e-6, 0.5e-6}};
    for (int n = 0; n < 5; n++) {
        struct plant p;
        double codes[3], skew_b_s = skews_s[n][0], skew_c_s = skews_s[n][1];
        start_on_a_slope(&p, skew_b_s, skew_c_s);
        struct plant_row row = bench_convert(&p, codes);
        check_true("there is a current", row.i_a[0] > 0.5);
        check_near("A at the trigger (A)", codes[0] * lsb_a, row.i_a[0], 0.6 * lsb_a);
        check_near("B later (A)", codes[1] * lsb_a, row.i_a[1] - rise_a_s / 2 * skew_b_s, 0.6 * lsb_a);
        check_near("C later (A)", codes[2] * lsb_a, row.i_a[2] - rise_a_s / 2 * skew_c_s, 0.6 * lsb_a);
    }
}

static void end_of_the_conversion(void)
{
    struct plant p;
    start_on_a_slope(&p, 0.4e-6, 1.4e-6);
    bench_write(&p, ADC_CONTROL, 1);
    sim_ps trigger_at = plant_next_trigger(&p);
    plant_advance(&p, trigger_at + sim_from_s(1.5e-6) - 1);
    check_hex("no EOC before the conversion's time", bench_read(&p, ADC_STATUS), 0);
    plant_advance(&p, trigger_at + sim_from_s(1.5e-6));
    check_hex("EOC at the trigger + 1.5 us whatever the skew", bench_read(&p, ADC_STATUS), 1);
}

/* What a reset interrupts is not sampled into the next conversion. */
static void reset_between(void)
{
    struct plant p;
    start_on_a_slope(&p, 1.2e-6, 1.2e-6);
    bench_write(&p, ADC_CONTROL, 1);
    while (p.next_sample == SIM_NEVER) {
        bench_run(&p, 0.1e-6);
    }
    plant_reset_fabric(&p);
    check_true("a reset forgets the samples to come", p.next_sample == SIM_NEVER);
    bench_run(&p, 100e-6);
    check_equal("and the conversion", bench_read(&p, ADC_SEQUENCE), 0);
}

/* ---- drift ---- */

static const struct sensor_params drifting = {
    .i_range_a = 20.48,
    .v_range_v = 40.96,
    .adc_bits = 12,
    .i_gain_a = 1,
    .i_gain_b = 1,
    .i_gain_c = 1,
    .i_offset_a_lsb = 5,
    .i_offset_drift_lsb_s = 2,
    .i_gain_drift_per_s = 1e-2,
    .encoder_counts = 4000,
    .encoder_index_counts = 1,
};

static double code_of(const struct sensor_params *p, int k, double t_s, double i_a)
{
    struct sensors s;
    sensors_init(&s, p, 1);
    return (double)sensors_current_code(&s, k, t_s, i_a) - 2048;
}

static void drifts_apart(void)
{
    for (double t = 0; t < 30; t += 3.7) {
        struct sensor_params p = drifting;
        p.i_gain_drift_per_s = 0;
        check_near("offset of A (LSB)", code_of(&p, 0, t, 0), 5 + 2 * t, 0.5);
        check_near("offset of B, the other way", code_of(&p, 1, t, 0), -2 * t, 0.5);
        check_near("offset of C stays", code_of(&p, 2, t, 0), 0, 0);
        p = drifting;
        p.i_offset_drift_lsb_s = 0;
        check_near("gain of A", code_of(&p, 0, t, 10) - 5, 1000 * (1 + 0.01 * t), 0.5);
        check_near("gain of B, the other way", code_of(&p, 1, t, 10), 1000 * (1 - 0.01 * t), 0.5);
        check_near("gain of C stays", code_of(&p, 2, t, 10), 1000, 0);
    }
}

/* Against the plant's own time. */
static void ages_in_the_plant(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    double codes[3];
    params.sensors.i_offset_drift_lsb_s = 1000;
    bench_start(&p, &params, (uint32_t[3]){2500, 2500, 2500});
    bench_write(&p, GATE_CONTROL, 0);
    bench_run(&p, 20e-3);
    struct plant_row row = bench_convert(&p, codes);
    check_near("after 20 ms of 1000 LSB/s", codes[0], 1000 * row.t_s, 0.5);
    check_between("which is", codes[0], 20, 21);
    check_near("and B", codes[1], -1000 * row.t_s, 0.5);
}

int main(void)
{
    samples_one_after_the_other();
    end_of_the_conversion();
    reset_between();
    drifts_apart();
    ages_in_the_plant();
    return check_end();
}

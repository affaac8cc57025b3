/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "bench.h"

#include <math.h>

#define PI 3.141592653589793

const struct motor_params bench_motor = {
    .pole_pairs = 4,
    .resistance_ohm = 0.3,
    .ld_h = 0.3e-3,
    .lq_h = 0.4e-3,
    .flux_wb = 7.5e-3,
    .inertia_kgm2 = 1e-5,
    .thermal_resistance_k_w = 2,
    .thermal_capacity_j_k = 50,
    .ambient_c = 25,
};

const struct motor_params bench_syrm = {
    .pole_pairs = 2,
    .resistance_ohm = 0.54,
    .sat_a_d0 = 17.4,
    .sat_a_dd = 373,
    .sat_s = 5,
    .sat_a_q0 = 52.1,
    .sat_a_qq = 658,
    .sat_t = 1,
    .sat_a_dq = 1120,
    .sat_u = 1,
    .sat_w = 2,
    .inertia_kgm2 = 0.015,
    .thermal_resistance_k_w = 1,
    .thermal_capacity_j_k = 1e4,
    .ambient_c = 25,
};

const struct motor_params bench_baldor = {
    .pole_pairs = 2,
    .resistance_ohm = 0.63,
    .sat_a_d0 = 3.96,
    .sat_a_dd = 28.46,
    .sat_s = 4,
    .sat_a_q0 = 5.89,
    .sat_a_qq = 2.672,
    .sat_t = 6,
    .sat_a_dq = 41.52,
    .sat_u = 1,
    .sat_v = 1,
    .sat_a_b = 81.75,
    .sat_a_bp = 1,
    .sat_w = 2,
    .sat_k_q = 0.1,
    .sat_psi_n_wb = 0.804,
    .inertia_kgm2 = 0.05,
    .thermal_resistance_k_w = 1,
    .thermal_capacity_j_k = 1e4,
    .ambient_c = 25,
};

const struct motor_params bench_thor = {
    .pole_pairs = 2,
    .resistance_ohm = 0.2,
    .sat_a_d0 = 28.51,
    .sat_a_dd = 128.8,
    .sat_s = 2,
    .sat_a_q0 = 20.64,
    .sat_a_qq = 5756,
    .sat_t = 6,
    .sat_a_dq = 4247,
    .sat_u = 1,
    .sat_v = 1,
    .sat_a_b = 7360,
    .sat_a_bp = 17.69,
    .sat_w = 2,
    .sat_k_q = 0.1398,
    .sat_psi_n_wb = 0.2196,
    .inertia_kgm2 = 4.228e-3,
    .thermal_resistance_k_w = 1,
    .thermal_capacity_j_k = 1e4,
    .ambient_c = 25,
};

const struct load_params bench_no_load = {0};
const struct motor_source bench_open_terminals = {.held = {true, true, true}};

const struct inverter_params bench_inverter = {
    .vbus_v = 24,
    .supply_resistance_ohm = 0.05,
    .supply_sinks = 1,
    .bus_capacitance_f = 1e-3,
    .r_on_ohm = 5e-3,
    .diode_v = 0.8,
    .oc_trip_a = 1000,
};

const struct sensor_params bench_sensors = {
    .i_range_a = 25,
    .v_range_v = 50,
    .adc_bits = 12,
    .adc_conversion_s = 1.5e-6,
    .i_gain_a = 1,
    .i_gain_b = 1,
    .i_gain_c = 1,
    .encoder_counts = 4000,
    .encoder_index_counts = 1,
};

struct plant_params bench_plant(void)
{
    return (struct plant_params){bench_motor, bench_no_load, bench_inverter, bench_sensors, 1, NULL};
}

uint32_t bench_read(struct plant *p, enum bench_register r)
{
    return plant_read(p, r, p->now);
}

void bench_write(struct plant *p, enum bench_register r, uint32_t value)
{
    plant_write(p, r, value, p->now);
}

void bench_run(struct plant *p, double duration_s)
{
    plant_advance(p, p->now + sim_from_s(duration_s));
}

void bench_compare(struct plant *p, int phase, uint32_t counts)
{
    bench_write(p, PWM_COMPARE_A + 4 * (unsigned)phase, counts);
    if (phase != 2) {
        bench_write(p, PWM_COMPARE_C, bench_read(p, PWM_COMPARE_C));
    }
}

void bench_leg(struct plant *p, int phase, uint32_t on_counts)
{
    bench_compare(p, phase, (on_counts + BENCH_DEAD_COUNTS) / 2);
}

/* The middle of the low sides' time lies half a dead time behind the valley; triggers and gates a clock behind their counts. */
void bench_trigger_at(struct plant *p, uint32_t count)
{
    const uint32_t half = BENCH_PERIOD_COUNTS / 2, place = (count + BENCH_DEAD_COUNTS / 2) % BENCH_PERIOD_COUNTS;
    bench_write(p, PWM_TRIGGER_1, place < half ? (half - place) | 1u << 16 : (place - half) | 1u << 17);
}

void bench_start(struct plant *p, const struct plant_params *params, const uint32_t on_counts[3])
{
    plant_init(p, params);
    bench_write(p, PWM_PERIOD, BENCH_PERIOD_COUNTS / 2);
    bench_write(p, PWM_DEAD, BENCH_DEAD_COUNTS);
    bench_write(p, PWM_MIN_PULSE, 1);
    for (int k = 0; k < 3; k++) {
        bench_leg(p, k, on_counts[k]);
    }
    bench_trigger_at(p, 0);
    bench_write(p, PWM_CONTROL, 1);
    bench_write(p, GATE_CONTROL, 1);
}

void bench_before_trigger(struct plant *p, const struct plant_params *params)
{
    bench_start(p, params, (uint32_t[3]){BENCH_PERIOD_COUNTS / 2, BENCH_PERIOD_COUNTS / 2, BENCH_PERIOD_COUNTS / 2});
    bench_run(p, 0.98e-3);
    plant_advance(p, plant_next_trigger(p) - sim_from_s(1e-6));
}

static void keep_row(void *row, const struct plant_row *of_trigger)
{
    *(struct plant_row *)row = *of_trigger;
}

struct plant_row bench_convert(struct plant *p, double codes[3])
{
    struct plant_row row;
    p->on_trigger = keep_row;
    p->context = &row;
    bench_write(p, ADC_CONTROL, 1);
    while (bench_read(p, ADC_STATUS) == 0) {
        bench_run(p, 1e-6);
    }
    for (unsigned k = 0; k < 3; k++) {
        codes[k] = (int32_t)bench_read(p, ADC_IA + 4 * k) / 16.0;
    }
    bench_write(p, ADC_STATUS, 3);
    bench_write(p, ADC_CONTROL, 0);
    p->on_trigger = NULL;
    return row;
}

struct motor bench_motor_at(double electrical_rad)
{
    struct motor_params p = bench_motor;
    struct motor m;
    p.initial_angle_rad = electrical_rad / p.pole_pairs;
    motor_init(&m, &p, &bench_no_load);
    return m;
}

void bench_run_motor(struct motor *m, const struct motor_source *source, double duration_s)
{
    double left_s = duration_s;
    while (left_s > 1e-12) {
        double dt_s = fmin(left_s, fmin(10e-6, motor_max_step_s(m, 0)));
        motor_step(m, source, dt_s);
        left_s -= dt_s;
    }
}

struct motor_source bench_vector(double v, double angle_rad)
{
    return (struct motor_source){
        .emf_v = {v * cos(angle_rad), v * cos(angle_rad - 2 * PI / 3), v * cos(angle_rad + 2 * PI / 3)}};
}

struct bridge bridge_on_bench(const struct inverter_params *ip)
{
    struct bridge b = {.now = 0};
    inverter_init(&b.inv, ip);
    motor_init(&b.m, &bench_motor, &bench_no_load);
    return b;
}

void bridge_gates(struct bridge *b, unsigned mask)
{
    inverter_command(&b->inv, mask, b->now);
    inverter_switch(&b->inv, b->now);
}

void bridge_advance(struct bridge *b, double duration_s)
{
    sim_ps end = b->now + sim_from_s(duration_s);
    while (b->now < end) {
        sim_ps next = inverter_next_switch(&b->inv);
        sim_ps to = next < end ? next : end;
        b->now = to > b->now ? inverter_advance(&b->inv, &b->m, b->now, to) : to;
        inverter_switch(&b->inv, b->now);
    }
}

double bridge_current(const struct bridge *b, int phase)
{
    double i_a[3];
    motor_currents(&b->m, i_a);
    return i_a[phase];
}

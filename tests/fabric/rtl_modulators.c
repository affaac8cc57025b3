/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The verilated RTL on the twin's bench, its currents from modulators: results against the true current, and how soon the fast
 * path has the gates off. argv[1] is the library of the RTL. */
#include <math.h>
#include <stdio.h>

#include "bench.h"
#include "check.h"
#include "fabric_rtl.h"

#define ADC_ON    0x9u /* ENABLE, MODULATORS */
#define OSR_64    0x511u
#define BIT_S     50e-9
#define TRIP_A    15.0
#define RANGE_A   25.0
#define FAST_BITS 16
#define LATENCY_S (13 * 10e-9) /* of bits through flip-flops, filter, comparison */

static const char *library;

static struct plant_params with_modulators(double noise, uint64_t seed)
{
    struct plant_params params = bench_plant();
    params.sensors.modulators = 1;
    params.sensors.modulator_noise = noise;
    params.fabric = fabric_rtl_open(library, &params.sensors, seed);
    return params;
}

/* Results of a window around the middle of the low sides' time, against the true current there. */
static void results(uint32_t modulator, double window_s, double bound_a)
{
    static const uint32_t a_more[3] = {2900, 2500, 2200};
    struct plant_params params = with_modulators(6.6e-4, 3);
    struct plant p;
    bench_start(&p, &params, a_more);
    bench_write(&p, PWM_TRIGGER_1, (2500u - (uint32_t)lround(window_s / 2 / 10e-9)) | 1u << 17);
    bench_write(&p, ADC_MODULATOR, modulator);
    bench_write(&p, ADC_CONTROL, ADC_ON);
    double squares = 0, largest_a = 0;
    int count = 0;
    uint32_t before = bench_read(&p, ADC_SEQUENCE);
    double i_a[3] = {0}, at_middle_a = 0;
    sim_ps middle_at = 0;
    for (int n = 0; n < 40000; n++) {
        bench_run(&p, 0.1e-6);
        sim_ps next = plant_next_trigger(&p);
        if (next > p.now && next - p.now <= 100000) {
            middle_at = next + sim_from_s(window_s / 2);
        }
        if (middle_at && p.now >= middle_at) {
            motor_currents(&p.motor, i_a);
            at_middle_a = i_a[0];
            middle_at = 0;
        }
        uint32_t sequence = bench_read(&p, ADC_SEQUENCE);
        if (sequence != before) {
            bench_write(&p, ADC_STATUS, 1);
        }
        if (sequence != before && count++ > 2) {
            double error_a = (int32_t)bench_read(&p, ADC_IA) / 32768.0 * RANGE_A - at_middle_a;
            squares += error_a * error_a;
            largest_a = fmax(largest_a, fabs(at_middle_a));
        }
        before = sequence;
    }
    char name[80];
    snprintf(name, sizeof name, "results of window %.1f us are the current in its middle, rms A", window_s * 1e6);
    check_true("conversions with modulators end", count > 70);
    check_between("the current moves, A", largest_a, 0.3, 20);
    printf("ok %s: %.4f, largest current %.2f\n", name, sqrt(squares / (count - 3)), largest_a);
    check_between(name, sqrt(squares / (count - 3)), 0, bound_a);
}

/* From the instant at which a phase's current passes the limit to the gates: microseconds; -1: they stay. The short, of `ohm`
 * between two legs, comes so much after some instant of the modulators' clock. */
static double trip_us(double ohm, double after_s, uint32_t limit)
{
    static const uint32_t apart[3] = {4000, 1000, 2500};
    struct plant_params params = with_modulators(6.6e-4, 3);
    struct plant p;
    bench_start(&p, &params, apart);
    bench_write(&p, ADC_MODULATOR_TRIP, limit);
    bench_write(&p, ADC_CONTROL, ADC_ON);
    bench_run(&p, 30e-6);
    bench_write(&p, ADC_STATUS, 1);
    bench_run(&p, 30e-6 + after_s); /* A high, B low */
    check_equal("fast path: quiet before the short", bench_read(&p, GATE_STATUS), 1);
    inverter_short(&p.inverter, 0, 1, ohm);
    double beyond_s = -1, t_s = 0;
    for (int n = 0; n < 5000 && p.gates != 0; n++) {
        double i_a[3];
        bench_run(&p, 10e-9);
        t_s += 10e-9;
        inverter_leg_currents(&p.inverter, &p.motor, i_a);
        if (beyond_s < 0 && fmax(fabs(i_a[0]), fabs(i_a[1])) > TRIP_A) {
            beyond_s = t_s;
        }
    }
    if (p.gates != 0) {
        return -1;
    }
    bench_run(&p, 1e-6);
    check_hex("fast path: OVERCURRENT, and the input still", bench_read(&p, GATE_STATUS) & 2u, 2);
    check_hex("fast path: ADC.STATUS has TRIP", bench_read(&p, ADC_STATUS) & 0x100u, 0x100);
    check_equal("fast path: ENABLE is cleared", bench_read(&p, GATE_CONTROL), 0);
    return (t_s - beyond_s) * 1e6;
}

/* Wherever in the fast path's raster of 0.8 us it comes. */
static void trips(double ohm, const char *name)
{
    double window_s = 3 * FAST_BITS * BIT_S, raster_s = FAST_BITS * BIT_S, least_us = 1e3, most_us = 0;
    uint32_t limit = (uint32_t)lround(TRIP_A / RANGE_A * 32768);
    for (int n = 0; n < 8; n++) {
        double us = trip_us(ohm, n * raster_s / 8, limit);
        check_between(name, us, 0.3, (window_s + raster_s + LATENCY_S) * 1e6);
        least_us = fmin(least_us, us);
        most_us = fmax(most_us, us);
    }
    printf("ok %s: %.2f to %.2f\n", name, least_us, most_us);
    check_true("fast path: where in the raster tells", most_us - least_us > 0.3e6 * raster_s);
}

int main(int argc, char **argv)
{
    library = argc == 2 ? argv[1] : "";
    results(OSR_64, 3 * 64 * BIT_S, 0.01);
    results(0x510u, 3 * 32 * BIT_S, 0.03);
    results(0x512u, 3 * 128 * BIT_S, 0.01);
    trips(0.2, "fast path: from the limit to the gates, us, 120 A at 15 A");
    trips(1.3, "fast path: the same, 18 A at 15 A");
    check_near("fast path: no limit, no trip", trip_us(0.2, 0, 0x1FFFF), -1, 0);
    return check_end();
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The disc: where its edges stand, what an eccentric one shows, and what a receiver miscounts. */
#include <math.h>
#include <stdlib.h>

#include "bench.h"
#include "check.h"

#define PI     3.141592653589793
#define COUNTS 4000
#define LINES  (COUNTS / 4)

static const struct sensor_params ideal = {.encoder_counts = COUNTS, .encoder_index_counts = 1};

static struct disc disc_of(const struct sensor_params *p)
{
    struct disc d;
    disc_init(&d, p, 11);
    return d;
}

static void ideal_disc(void)
{
    struct disc d = disc_of(&ideal);
    check_equal("edges at 0", disc_edges(&d, 0), 0);
    check_equal("edges of a turn and a half", disc_edges(&d, 3 * PI + 1e-9), 6000);
    check_equal("just below 0", disc_edges(&d, -1e-9), -1);
    check_equal("a turn back", disc_edges(&d, -2 * PI + 1e-9), -4000);
    struct sensor_params p = ideal;
    p.index_angle_rad = PI / 2 + 1e-9;
    check_equal("index", disc_of(&p).index.first, 1000);
    p.index_angle_rad = -PI / 2 + 1e-9;
    check_equal("index before 0 is within the turn", disc_of(&p).index.first, 3000);
    p.encoder_index_counts = 3;
    check_equal("width of the index", disc_of(&p).index.last, 3002);
}

/* ---- displaced edges ---- */

/* The two signals, as the head sees them at an angle in lines. */
static bool signal(double line, double rises, double falls)
{
    double in_line = line - rises - floor(line - rises);
    return in_line < falls - rises;
}

static void quadrature(double a, double phase)
{
    struct sensor_params p = ideal;
    p.encoder_asymmetry = a;
    p.encoder_phase = phase;
    struct disc d = disc_of(&p);
    static const bool a_is[4] = {true, true, false, false}, b_is[4] = {false, true, true, false};
    int64_t before = disc_edges(&d, -2.0 * 2 * PI / LINES);
    int wrong = 0, jumps = 0, high_a = 0, high_b = 0, both = 0;
    const int samples = 40000; /* over ten lines */
    for (int n = 0; n < samples; n++) {
        double line = -2 + 10.0 * (n + 0.5) / samples;
        int64_t edges = disc_edges(&d, line * 2 * PI / LINES);
        bool a_high = a_is[edges & 3], b_high = b_is[edges & 3];
        wrong += a_high != signal(line, -a, 0.5 + a) || b_high != signal(line, 0.25 + phase - a, 0.75 + phase + a);
        jumps += edges < before || edges > before + 1;
        high_a += a_high;
        high_b += b_high;
        both += a_high && b_high;
        before = edges;
    }
    check_equal("signals against their definition", wrong, 0);
    check_equal("one edge after the other", jumps, 0);
    check_near("A's high share", (double)high_a / samples, 0.5 + 2 * a, 1e-3);
    check_near("B's high share", (double)high_b / samples, 0.5 + 2 * a, 1e-3);
    check_near("both high: a quarter, more by the asymmetry, less by the phase", (double)both / samples,
               0.25 + 2 * a - phase, 1e-3);
}

/* ---- what is shown over a turn ---- */

static void eccentric_disc(void)
{
    const double ecc_rad = 0.02, phase_rad = 0.7;
    struct sensor_params p = ideal;
    p.encoder_ecc_rad = ecc_rad;
    p.encoder_ecc_phase_rad = phase_rad;
    struct disc d = disc_of(&p);
    double in_phase = 0, across = 0, worst = 0;
    const int samples = 20000;
    for (int n = 0; n < samples; n++) {
        double theta = 2 * PI * (n + 0.5) / samples;
        double shown = ((double)disc_edges(&d, theta) + 0.5) * 2 * PI / COUNTS - theta;
        in_phase += shown * sin(theta - phase_rad) * 2 / samples;
        across += shown * cos(theta - phase_rad) * 2 / samples;
        worst = fmax(worst, fabs(shown));
    }
    check_near("eccentricity: once a turn (rad)", in_phase, ecc_rad, 1e-5);
    check_near("eccentricity: nothing across", across, 0, 1e-5);
    check_near("eccentricity: largest error (rad)", worst, ecc_rad, 2 * PI / COUNTS);
}

/* Small steps to and fro, of which most pass no edge, against a fresh disc that has no past. */
static void no_memory(void)
{
    struct sensor_params p = ideal;
    p.encoder_asymmetry = -0.03;
    p.encoder_phase = 0.05;
    p.encoder_ecc_rad = 0.05;
    struct disc d = disc_of(&p);
    double theta = 1;
    int wrong = 0;
    for (int n = 0; n < 100000; n++) {
        theta += any_real(-1, 1) * pow(10, any_between(-7, -3));
        struct disc fresh = disc_of(&p);
        wrong += disc_edges(&d, theta) != disc_edges(&fresh, theta);
    }
    check_equal("counts that depend on the way", wrong, 0);
}

/* ---- miscounts ---- */

static double miscounted(double lost, double extra, int64_t step, int64_t edges)
{
    struct sensor_params p = ideal;
    p.encoder_lost_per_rev = lost;
    p.encoder_extra_per_rev = extra;
    struct disc d = disc_of(&p);
    int64_t sum = 0;
    for (int64_t n = 0; n < edges / llabs(step); n++) {
        sum += disc_miscounts(&d, step);
    }
    return (double)sum;
}

static void rates(void)
{
    /* The count of a Poisson process scatters by the root of its mean. */
    const double turns = 10000, edges = turns * COUNTS;
    check_near("lost", miscounted(0.5, 0, 40, edges), -0.5 * turns, 4 * sqrt(0.5 * turns));
    check_near("extra", miscounted(0, 2, 40, edges), 2 * turns, 4 * sqrt(2 * turns));
    check_near("both", miscounted(3, 1, 40, edges), -2 * turns, 4 * sqrt(4 * turns));
    check_near("backwards, a lost one is one less that way", miscounted(0.5, 0, -40, edges), 0.5 * turns,
               4 * sqrt(0.5 * turns));
    check_equal("none", miscounted(0, 0, 40, edges), 0);
    check_near("however the way is cut", miscounted(0.5, 0, 40000, edges), miscounted(0.5, 0, 1, edges), 0);
}

/* Gaps between two lost edges: exponential, so their deviation is their mean. */
static void without_memory(void)
{
    struct sensor_params p = ideal;
    p.encoder_lost_per_rev = 40;
    struct disc d = disc_of(&p);
    double sum = 0, square = 0, gap = 0;
    int count = 0;
    for (int n = 0; n < 1000000; n++) {
        gap++;
        for (int64_t lost = -disc_miscounts(&d, 1); lost > 0; lost--) {
            sum += gap;
            square += gap * gap;
            gap = 0;
            count++;
        }
    }
    double mean = sum / count, deviation = sqrt(square / count - mean * mean);
    check_near("mean gap", mean, 100, 4 * 100 / sqrt(count));
    check_near("its deviation", deviation, 100, 8 * 100 / sqrt(count));
}

/* ---- in the plant, through the registers ---- */

static void start_spinning(struct plant *p, const struct plant_params *params, double speed_rad_s)
{
    bench_start(p, params, (uint32_t[3]){2500, 2500, 2500});
    bench_write(p, GATE_CONTROL, 0);
    bench_write(p, ENC_COUNTS, COUNTS);
    bench_write(p, ENC_CONTROL, 1);
    motor_spin(&p->motor, speed_rad_s);
}

static void position_slips(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    params.sensors.encoder_lost_per_rev = 20;
    start_spinning(&p, &params, 2 * PI * 200);
    bench_run(&p, 50e-3 + 1e-9); /* ten turns */
    double slipped = (double)bench_read(&p, ENC_POSITION) - COUNTS;
    check_near("ten turns of 20 lost counts", slipped, -200, 4 * sqrt(200));
    bench_write(&p, ENC_CONTROL, 0);
    uint32_t before = bench_read(&p, ENC_POSITION);
    bench_run(&p, 20e-3);
    check_equal("a counter that is off miscounts nothing", bench_read(&p, ENC_POSITION), before);
}

/* A pulse of 8 edges rises at its first edge forwards and at its last edge backwards. */
static void index_width(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    params.sensors.index_angle_rad = 1.0; /* in the gap after edge 636 */
    params.sensors.encoder_index_counts = 8;
    start_spinning(&p, &params, 500);
    bench_run(&p, 1.2 / 500);
    check_equal("INDEX forwards", bench_read(&p, ENC_INDEX), 636);
    motor_spin(&p.motor, -500);
    bench_run(&p, 0.4 / 500);
    check_equal("INDEX backwards", bench_read(&p, ENC_INDEX), 643);
}

/* The position latched while the shaft turns, against the shaft's own angle. */
static void eccentric_in_the_plant(void)
{
    struct plant_params params = bench_plant();
    struct plant p;
    double worst = 0;
    params.sensors.encoder_ecc_rad = 0.05;
    start_spinning(&p, &params, 2 * PI * 100);
    for (int n = 0; n < 200; n++) {
        bench_run(&p, 50e-6);
        double shown = bench_read(&p, ENC_POSITION) * 2 * PI / COUNTS, theta = fmod(p.motor.theta_rad, 2 * PI);
        double error = remainder(shown - theta - 0.05 * sin(theta), 2 * PI);
        worst = fmax(worst, fabs(error + PI / COUNTS));
    }
    check_near("POSITION of an eccentric disc (rad)", worst, 0, PI / COUNTS * 1.01);
}

int main(void)
{
    ideal_disc();
    quadrature(0, 0);
    quadrature(0.06, 0);
    quadrature(0, -0.1);
    quadrature(-0.05, 0.12);
    quadrature(0.1, 0.04);
    eccentric_disc();
    no_memory();
    rates();
    without_memory();
    position_slips();
    index_width();
    eccentric_in_the_plant();
    return check_end();
}

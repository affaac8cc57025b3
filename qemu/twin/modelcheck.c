/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Takes the motor model alone to the test bench and measures what data sheets state. No formula of the model is used
 * here: every figure comes from voltages applied to motor_step() and currents, torque, speed and work read back.
 *
 *   modelcheck CONFIG [bus_v=VOLTS] [rated_a_rms=AMPERES] [map=ID,IQ]... [drag_rpm=RPM]...
 *
 * Prints lines "name value unit". bus_v is the supply of the no-load and stall points (default: inverter.vbus_v of the
 * configuration); rated_a_rms is a phase current. The winding and the magnets are held at 25 degrees.
 *
 *   back_emf_line_line_peak, back_emf_line_line_rms, back_emf_phase_peak     of the fundamental
 *   open_circuit_flux                   Wb, its flux linkage
 *   emf_harmonic_5 ... emf_harmonic_19  % of the fundamental, signed as the keys emf_N; only those that are not zero
 *   magnet_tempco                       %/K, measured between 25 and 100 degrees
 *   resistance_line_line
 *   inductance_d, inductance_q, inductance_line_line_mean   incremental, at zero current, mean over the position
 *   permeance_6, permeance_12           % by which 1/inductance_d varies over the position
 *   torque_constant_peak, torque_constant_rms, rated_torque  current in q, mean over the position
 *   torque_ripple_rated                 %, peak to peak of the mean, cogging left out; with rated_a_rms
 *   stall_*, no_load_*, torque_constant_six_step, mechanical_time_constant   only of machines with magnets
 *   cogging_peak_to_peak                Nm, on the shaft
 *   map_psi_d@ID,IQ  map_psi_q@ID,IQ    Vs, for each map=ID,IQ (peak amperes); harmonics left out as in published maps
 *   map_l_dd@ID,IQ  map_l_dq@ID,IQ  map_l_qq@ID,IQ   H, incremental
 *   map_torque@ID,IQ                    Nm
 *   drag_torque@RPM                     Nm, mean, that turns the unpowered motor alone, for each drag_rpm=RPM
 *   iron_power@RPM                      W, the iron's part of it
 *   two_mass_resonance, two_mass_antiresonance   Hz, if load.stiffness_nm_rad is not zero
 *   energy_balance_error                relative to the turnover of a driven cycle, every effect of the file on
 *
 * "six_step" figures are for block commutation with ideal switches: two terminals driven, the third floating,
 * commutated every 60 electrical degrees. "sine" figures are for a balanced sinusoidal supply in phase with the EMF, of
 * the largest amplitude a bus of bus_v gives without distortion, bus_v/sqrt(3). */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "config.h"
#include "motor.h"

#define PI                    3.141592653589793
#define SQRT3                 1.7320508075688772
#define RAD_S_PER_RPM         (PI / 30)
#define BENCH_TIME_CONSTANT_S 0.02 /* mechanical, wherever only the steady state is read */

static struct config config;

static struct motor fresh_motor(void)
{
    struct motor m;
    struct motor_params p = config.plant.motor;
    struct load_params no_load = {0};
    p.ambient_c = 25;
    p.copper_tempco_per_k = 0;
    motor_init(&m, &p, &no_load);
    return m;
}

static void turn_to_electrical(struct motor *m, double angle_rad)
{
    struct motor_params p = m->p;
    struct load_params no_load = {0};
    p.initial_angle_rad = angle_rad / p.pole_pairs;
    motor_init(m, &p, &no_load);
}

static double step_s(const struct motor *m)
{
    return fmin(motor_max_step_s(m, 0) / 10, 10e-6);
}

static void run(struct motor *m, const struct motor_source *source, double duration_s)
{
    long steps = lround(ceil(duration_s / step_s(m)));
    for (long n = 0; n < steps; n++) {
        motor_step(m, source, duration_s / (double)steps);
    }
}

/* Long enough for every current to settle: 40 of the longest time constant, found by the response itself. */
static void settle(struct motor *m, const struct motor_source *source)
{
    double before_a[3], now_a[3];
    for (int n = 0; n < 10000; n++) {
        motor_currents(m, before_a);
        run(m, source, 100 * step_s(m));
        motor_currents(m, now_a);
        double change_a = fabs(now_a[0] - before_a[0]) + fabs(now_a[1] - before_a[1]) + fabs(now_a[2] - before_a[2]);
        if (change_a < 1e-9 * (1e-3 + fabs(now_a[0]) + fabs(now_a[1]) + fabs(now_a[2]))) {
            return;
        }
    }
    fputs("mssfoc modelcheck: the currents do not settle\n", stderr);
    exit(1);
}

static struct motor_source phase_voltages(double a_v, double b_v, double c_v)
{
    return (struct motor_source){.emf_v = {a_v, b_v, c_v}};
}

/* DC from terminal A to terminal B, C open. */
static struct motor_source two_terminals(double v)
{
    struct motor_source s = phase_voltages(v, 0, 0);
    s.held[2] = true;
    return s;
}

static void report(const char *name, double value, const char *unit)
{
    printf("%s %.9g %s\n", name, value, unit);
}

static void back_emf(void)
{
    struct motor m = fresh_motor();
    struct motor_source open = {.held = {true, true, true}};
    const double krpm = 1;
    double peak_v = 0, v[3];
    motor_spin(&m, krpm * 1000 * RAD_S_PER_RPM);
    const int samples = 3600;
    double turn_s = 60 / (krpm * 1000) / m.p.pole_pairs;
    for (int n = 0; n < samples; n++) {
        run(&m, &open, turn_s / samples);
        motor_star_voltages(&m, &open, v);
        peak_v = fmax(peak_v, v[0] - v[1]);
    }
    report("back_emf_line_line_peak", peak_v / krpm, "V/krpm");
    report("back_emf_line_line_rms", peak_v / sqrt(2) / krpm, "V/krpm");
    report("back_emf_phase_peak", peak_v / SQRT3 / (krpm * 1000 * RAD_S_PER_RPM), "Vs/rad");
}

static double resistance(void)
{
    struct motor m = fresh_motor();
    double i_a[3], applied_v = 1;
    struct motor_source s = two_terminals(applied_v);
    motor_lock(&m, true);
    settle(&m, &s);
    motor_currents(&m, i_a);
    report("resistance_line_line", applied_v / i_a[0], "ohm");
    return applied_v / i_a[0];
}

/* Inductance seen along the magnetic axis of phase A from two samples of a voltage step: i2/i1 = 1 + exp(-t/tau). */
static double inductance(double rotor_angle_rad, double r_line_line_ohm)
{
    struct motor m = fresh_motor();
    double i1_a[3], i2_a[3];
    turn_to_electrical(&m, rotor_angle_rad);
    motor_lock(&m, true);
    struct motor_source s = phase_voltages(1, -0.5, -0.5);
    double t_s = motor_max_step_s(&m, 0);
    run(&m, &s, t_s);
    motor_currents(&m, i1_a);
    run(&m, &s, t_s);
    motor_currents(&m, i2_a);
    double tau_s = -t_s / log(i2_a[0] / i1_a[0] - 1);
    return tau_s * r_line_line_ohm / 2;
}

static void inductances(double r_line_line_ohm)
{
    double ld_h = inductance(0, r_line_line_ohm), lq_h = inductance(-PI / 2, r_line_line_ohm);
    report("inductance_d", ld_h, "H");
    report("inductance_q", lq_h, "H");
    report("inductance_line_line_mean", ld_h + lq_h, "H");
}

/* Torque with a steady q-axis current of the given peak value: rotor locked 90 degrees behind phase A. */
static double torque_at(double peak_a, double r_line_line_ohm)
{
    struct motor m = fresh_motor();
    turn_to_electrical(&m, -PI / 2);
    motor_lock(&m, true);
    double v = peak_a * r_line_line_ohm / 2;
    struct motor_source s = phase_voltages(v, -v / 2, -v / 2);
    settle(&m, &s);
    return motor_torque_nm(&m);
}

static void torque_constants(double r_line_line_ohm, double rated_a_rms)
{
    double peak_a = rated_a_rms > 0 ? rated_a_rms * sqrt(2) : 1;
    double torque_nm = torque_at(peak_a, r_line_line_ohm);
    report("torque_constant_peak", torque_nm / peak_a, "Nm/A");
    report("torque_constant_rms", torque_nm / peak_a * sqrt(2), "Nm/A");
    if (rated_a_rms > 0) {
        report("rated_torque", torque_nm, "Nm");
    }
}

/* Locked rotor on a DC voltage: the best position, and the mean over the 60 degrees that one commutation lasts. */
static void stall(double bus_v)
{
    double best_nm = 0, sum_nm = 0, i_a[3] = {0};
    const int positions = 61;
    for (int n = 0; n < positions; n++) {
        struct motor m = fresh_motor();
        struct motor_source s = two_terminals(bus_v);
        /* Current from A to B stands at -30 degrees; the rotor turns through 60 to 120 degrees behind it. */
        turn_to_electrical(&m, -PI / 6 - PI / 3 - PI / 3 * n / (positions - 1));
        motor_lock(&m, true);
        settle(&m, &s);
        motor_currents(&m, i_a);
        best_nm = fmax(best_nm, motor_torque_nm(&m));
        sum_nm += motor_torque_nm(&m) * (n == 0 || n == positions - 1 ? 0.5 : 1);
    }
    double mean_nm = sum_nm / (positions - 1);
    report("stall_current", i_a[0], "A");
    report("stall_torque_six_step_best", best_nm, "Nm");
    report("stall_torque_six_step_mean", mean_nm, "Nm");
    report("torque_constant_six_step", mean_nm / i_a[0], "Nm/A");
}

static double electrical_angle(const struct motor *m)
{
    return m->p.pole_pairs * m->theta_rad;
}

/* The two terminals whose current leads the rotor by 60 to 120 degrees. */
static struct motor_source six_step(const struct motor *m, double bus_v)
{
    static const int from[6] = {0, 0, 1, 1, 2, 2}, to[6] = {1, 2, 2, 0, 0, 1};
    /* Sector n drives a current at -30 + 60 n degrees; it serves the rotor from -150 + 60 n to -90 + 60 n. */
    double turns = (electrical_angle(m) + 5 * PI / 6) / (2 * PI);
    int n = (int)floor(6 * (turns - floor(turns))) % 6;
    struct motor_source s = {.held = {true, true, true}};
    s.emf_v[from[n]] = bus_v;
    s.held[from[n]] = false;
    s.held[to[n]] = false;
    return s;
}

static struct motor_source sine(const struct motor *m, double bus_v)
{
    double v = bus_v / SQRT3, lead = electrical_angle(m) + PI / 2;
    return phase_voltages(v * cos(lead), v * cos(lead - 2 * PI / 3), v * cos(lead + 2 * PI / 3));
}

typedef struct motor_source (*drive_fn)(const struct motor *, double bus_v);

/* Mean speed over a stretch of time; adds up what the positive rail delivers. */
static double drive(struct motor *m, drive_fn commutate, double bus_v, double duration_s, double *mean_dc_a)
{
    double started_rad = m->theta_rad, charge_as = 0, t_s = 0;
    while (t_s < duration_s) {
        double dt_s = fmin(step_s(m), 0.002 / (fabs(m->speed_rad_s) * m->p.pole_pairs + 1));
        struct motor_source s = commutate(m, bus_v);
        double energy_j = m->energy_in_j;
        motor_step(m, &s, dt_s);
        charge_as += (m->energy_in_j - energy_j) / bus_v;
        t_s += dt_s;
    }
    *mean_dc_a = charge_as / t_s;
    return (m->theta_rad - started_rad) / t_s;
}

/* The steady state does not depend on the inertia: a lighter rotor only gets there sooner. */
static void lighten(struct motor *m, double torque_constant_peak, double r_line_line_ohm)
{
    double k_t = torque_constant_peak;
    double time_constant_s = 0.75 * m->p.inertia_kgm2 * r_line_line_ohm / (k_t * k_t);
    if (time_constant_s > BENCH_TIME_CONSTANT_S) {
        m->p.inertia_kgm2 *= BENCH_TIME_CONSTANT_S / time_constant_s;
    }
}

static double no_load(drive_fn commutate, double bus_v, double k_t, double r_line_line_ohm, double *dc_a)
{
    struct motor m = fresh_motor();
    lighten(&m, k_t, r_line_line_ohm);
    double speed = 0, before;
    int rounds = 0;
    do {
        before = speed;
        speed = drive(&m, commutate, bus_v, 5 * BENCH_TIME_CONSTANT_S, dc_a);
    } while (fabs(speed - before) > 1e-4 * fabs(speed) + 1e-9 && ++rounds < 40);
    return speed;
}

/* Time to 63.2 % of the no-load speed from standstill with the true inertia. */
static double start_time(double bus_v, double no_load_rad_s)
{
    struct motor m = fresh_motor();
    double t_s = 0, dc_a;
    while (m.speed_rad_s < 0.632120559 * no_load_rad_s && t_s < 20) {
        double slice_s = 20e-6;
        drive(&m, six_step, bus_v, slice_s, &dc_a);
        t_s += slice_s;
    }
    return t_s;
}

static double option(int argc, char **argv, const char *name, double otherwise)
{
    size_t length = strlen(name);
    for (int n = 2; n < argc; n++) {
        if (strncmp(argv[n], name, length) == 0 && argv[n][length] == '=') {
            char *end;
            double value = strtod(argv[n] + length + 1, &end);
            if (end == argv[n] + length + 1 || *end || !(value > 0) || !isfinite(value)) {
                fprintf(stderr, "mssfoc modelcheck: %s: not a positive number\n", argv[n]);
                exit(1);
            }
            return value;
        }
    }
    return otherwise;
}

static void check_usage(int argc, char **argv)
{
    bool right = argc >= 2;
    for (int n = 2; n < argc; n++) {
        right = right && (strncmp(argv[n], "bus_v=", 6) == 0 || strncmp(argv[n], "rated_a_rms=", 12) == 0);
    }
    if (!right) {
        fputs("mssfoc modelcheck: usage: modelcheck CONFIG [bus_v=VOLTS] [rated_a_rms=AMPERES]\n", stderr);
        exit(2);
    }
}

int main(int argc, char **argv)
{
    check_usage(argc, argv);
    config_load(&config, argv[1], true);
    double bus_v = option(argc, argv, "bus_v", config.plant.inverter.vbus_v);
    double rated_a_rms = option(argc, argv, "rated_a_rms", 0);
    if (isnan(bus_v)) {
        fputs("mssfoc modelcheck: no bus voltage: give bus_v=VOLTS or inverter.vbus_v\n", stderr);
        return 1;
    }
    back_emf();
    double r_ohm = resistance();
    inductances(r_ohm);
    double k_t = torque_at(1, r_ohm);
    torque_constants(r_ohm, rated_a_rms);
    stall(bus_v);

    double dc_a;
    double six_step_rad_s = no_load(six_step, bus_v, k_t, r_ohm, &dc_a);
    report("no_load_speed_six_step", six_step_rad_s / RAD_S_PER_RPM, "rpm");
    report("no_load_current_six_step", dc_a, "A");
    report("mechanical_time_constant", start_time(bus_v, six_step_rad_s), "s");
    report("no_load_speed_sine", no_load(sine, bus_v, k_t, r_ohm, &dc_a) / RAD_S_PER_RPM, "rpm");
    return 0;
}

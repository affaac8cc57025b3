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
 *   stall_*, no_load_*, torque_constant_six_step, mechanical_time_constant   only with magnets and without a map
 *   cogging_peak_to_peak                Nm, on the shaft
 *   map_psi_d@ID,IQ  map_psi_q@ID,IQ    Vs, for each map=ID,IQ (peak amperes); harmonics left out as in published maps
 *   map_l_dd@ID,IQ  map_l_dq@ID,IQ  map_l_qq@ID,IQ   H, incremental
 *   map_torque@ID,IQ                    Nm
 *   map_ripple@ID,IQ  map_ripple_18@ID,IQ   Nm, on the shaft over the position, with harmonics, slots and cogging: peak to
 *                                       peak, and the amplitude of order 18 an electrical turn
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
#include "modelbench.h"

static struct config config;

/* The value of an argument NAME=VALUE, or NULL. */
static const char *value_of(const char *argument, const char *name)
{
    size_t length = strlen(name);
    return strncmp(argument, name, length) == 0 && argument[length] == '=' ? argument + length + 1 : NULL;
}

__attribute__((noreturn)) static void bad_argument(const char *argument, const char *what)
{
    fprintf(stderr, "mssfoc modelcheck: %s: not %s\n", argument, what);
    exit(1);
}

static double option(int argc, char **argv, const char *name, double otherwise)
{
    for (int n = 2; n < argc; n++) {
        const char *text = value_of(argv[n], name);
        if (text) {
            char *end;
            double value = strtod(text, &end);
            if (end == text || *end || !(value > 0) || !isfinite(value)) {
                bad_argument(argv[n], "a positive number");
            }
            return value;
        }
    }
    return otherwise;
}

static void check_usage(int argc, char **argv)
{
    static const char *const names[] = {"bus_v", "rated_a_rms", "map", "drag_rpm"};
    bool right = argc >= 2;
    for (int n = 2; n < argc; n++) {
        bool known = false;
        for (size_t k = 0; k < sizeof names / sizeof names[0]; k++) {
            known = known || value_of(argv[n], names[k]);
        }
        right = right && known;
    }
    if (!right) {
        fputs("mssfoc modelcheck: usage: modelcheck CONFIG [bus_v=VOLTS] [rated_a_rms=AMPERES] [map=ID,IQ]... "
              "[drag_rpm=RPM]...\n",
              stderr);
        exit(2);
    }
}

static void measure_points(const struct modelbench *b, int argc, char **argv)
{
    for (int n = 2; n < argc; n++) {
        const char *point = value_of(argv[n], "map"), *rpm = value_of(argv[n], "drag_rpm");
        if (point && !measure_map(b, point)) {
            bad_argument(argv[n], "two currents ID,IQ");
        }
        if (rpm && !measure_drag(b, rpm)) {
            bad_argument(argv[n], "a positive number");
        }
    }
}

int main(int argc, char **argv)
{
    check_usage(argc, argv);
    config_load(&config, argv[1], true);
    struct modelbench b = {
        .motor = config.axis[0].plant.motor,
        .load = config.axis[0].plant.load,
        .bus_v = option(argc, argv, "bus_v", config.axis[0].plant.inverter.vbus_v),
        .rated_a = option(argc, argv, "rated_a_rms", 0) * sqrt(2),
    };
    if (isnan(b.bus_v)) {
        fputs("mssfoc modelcheck: no bus voltage: give bus_v=VOLTS or inverter.vbus_v\n", stderr);
        return 1;
    }
    measure_emf(&b);
    measure_winding(&b);
    measure_torque(&b);
    if (b.open_circuit_vs > 0 && b.motor.sat_a_d0 == 0) {
        measure_on_bus(&b);
    }
    measure_cogging(&b);
    measure_points(&b, argc, argv);
    if (b.load.stiffness_nm_rad > 0) {
        measure_two_masses(&b);
    }
    measure_balance(&b);
    return 0;
}

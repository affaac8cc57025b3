/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The test bench of modelcheck.c: a motor of the configuration, sources, and what is measured with them. */
#ifndef TWIN_MODELBENCH_H
#define TWIN_MODELBENCH_H

#include "motor.h"

#define PI            3.141592653589793
#define SQRT3         1.7320508075688772
#define RAD_S_PER_RPM (PI / 30)

struct modelbench {
    struct motor_params motor;
    struct load_params load;
    double bus_v;
    double rated_a; /* peak; 0: not given */
    /* found on the way, for what comes after: */
    double phase_ohm, open_circuit_vs, torque_constant;
};

void report(const char *name, double value, const char *unit);
/* NAME@POINT */
void report_at(const char *name, const char *point, double value, const char *unit);

/* A motor at 25 degrees, whatever its losses, with nothing on its shaft, turned to an electrical angle. */
struct motor bench_motor_at(const struct modelbench *b, double electrical_rad);
/* Parameters of such a motor, to be changed further. */
struct motor_params bench_params(const struct modelbench *b);

struct motor_source phase_voltages(double a_v, double b_v, double c_v);
/* DC from terminal A to terminal B, C open. */
struct motor_source two_terminals(double v);
/* A voltage of this size along an electrical angle. */
struct motor_source voltage_vector(double v, double angle_rad);
extern const struct motor_source open_terminals;

double bench_step_s(const struct motor *m);
void run(struct motor *m, const struct motor_source *source, double duration_s);
/* Until the currents stay; the shaft is held meanwhile. */
void settle(struct motor *m, const struct motor_source *source);

/* modelcheck_field.c: no-load flux and EMF, resistance, inductances, torque over current. */
void measure_emf(struct modelbench *b);
void measure_winding(struct modelbench *b);
void measure_torque(struct modelbench *b);
/* "ID,IQ"; false if it is no such point. */
bool measure_map(const struct modelbench *b, const char *point);

/* modelcheck_drive.c: stall, no load and start on the bus. */
void measure_on_bus(const struct modelbench *b);

/* modelcheck_shaft.c: cogging, drag, the two masses, the balance of energy. */
void measure_cogging(const struct modelbench *b);
bool measure_drag(const struct modelbench *b, const char *rpm);
void measure_two_masses(const struct modelbench *b);
void measure_balance(const struct modelbench *b);

#endif

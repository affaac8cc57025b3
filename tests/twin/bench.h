/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A plant on the bench: a salient motor, a 24 V bridge, ideal sensors, and the fabric registers as docs/fabric.md has
 * them. Addresses and bits are written down here once more on purpose: the twin's own are under test. */
#ifndef TESTS_TWIN_BENCH_H
#define TESTS_TWIN_BENCH_H

#include "plant.h"

enum bench_register {
    PWM_CONTROL = 0x0000,
    PWM_PERIOD = 0x0008,
    PWM_DEAD = 0x000C,
    PWM_MIN_PULSE = 0x0010,
    PWM_TRIGGER_1 = 0x001C,
    PWM_COMPARE_A = 0x0028,
    PWM_COMPARE_C = 0x0030,
    ADC_CONTROL = 0x0100,
    ADC_STATUS = 0x0104,
    ADC_IA = 0x0108,
    ADC_VBUS = 0x0114,
    ADC_SEQUENCE = 0x0118,
    ADC_OFFSET_A = 0x011C,
    ADC_I_TRIP = 0x0128,
    ADC_SUM_TRIP = 0x012C,
    ADC_V_MIN = 0x0130,
    ADC_V_MAX = 0x0134,
    ADC_TEMP = 0x0138,
    ADC_VALID = 0x013C,
    ADC_GAIN_A = 0x0140,
    ADC_SETTLE = 0x014C,
    ADC_MODULATOR = 0x0150,
    ADC_MODULATOR_TRIP = 0x0154,
    ENC_CONTROL = 0x0200,
    ENC_COUNTS = 0x0204,
    ENC_POSITION = 0x0208,
    ENC_LATCHED = 0x020C,
    ENC_INDEX = 0x0210,
    ENC_STATUS = 0x0214,
    ENC_EDGE_TIME = 0x0218,
    ENC_LATCH_TIME = 0x021C,
    ENC_FILTER = 0x0220,
    ENC_HALL = 0x0224,
    ENC_HALL_TIME = 0x0228,
    GATE_CONTROL = 0x0300,
    GATE_STATUS = 0x0304,
    GATE_ID = 0x0308,
    GATE_CHOPPER = 0x030C,
    GATE_CHOPPER_ON = 0x0310,
    GATE_CHOPPER_OFF = 0x0314,
    GATE_AXES = 0x0318,
};

#define BENCH_PERIOD_COUNTS 5000 /* 20 kHz */
#define BENCH_PERIOD_PS     (BENCH_PERIOD_COUNTS * (sim_ps)SIM_PS_PER_FABRIC_CLOCK)
#define BENCH_DEAD_COUNTS   100 /* 1 us */

/* Ld 0.3 mH, Lq 0.4 mH, 0.3 ohm, 7.5 mWb, 4 pole pairs; no friction, no cogging, no warming; rotor at angle 0. */
extern const struct motor_params bench_motor;
extern const struct load_params bench_no_load;
/* Machines with a published saturation map (M. Hinkkanen et al. 2017; L. Lelli et al. 2024; SyR-e's THOR, fitted): the
 * 6.7 kW synchronous reluctance machine, Baldor ECS101M0H7EF4 and THOR with magnets. No losses, no harmonics. */
extern const struct motor_params bench_syrm, bench_baldor, bench_thor;
/* 24 V behind 50 mohm, 1 mF, switches of 5 mohm without delays, diodes of 0.8 V, comparators at 1000 A. */
extern const struct inverter_params bench_inverter;
/* +-25 A, 50 V, no noise, 4000 counts. */
extern const struct sensor_params bench_sensors;
struct plant_params bench_plant(void);

uint32_t bench_read(struct plant *p, enum bench_register r);
void bench_write(struct plant *p, enum bench_register r, uint32_t value);
void bench_run(struct plant *p, double duration_s);

/* The compare of a phase, in effect with the others from the next valley on. */
void bench_compare(struct plant *p, int phase, uint32_t counts);
/* The same for an on-time of the high side, dead time taken off. */
void bench_leg(struct plant *p, int phase, uint32_t on_counts);
/* Where in the period the trigger comes: 0 is the middle of the low sides' time. */
void bench_trigger_at(struct plant *p, uint32_t count);
/* A fresh plant that switches at 20 kHz with these on-times, LIVE, triggers in the middle of the low sides' time, ADC off. */
void bench_start(struct plant *p, const struct plant_params *params, const uint32_t on_counts[3]);
/* A fresh plant with all legs at half, whose next trigger comes 1 us after the return. */
void bench_before_trigger(struct plant *p, const struct plant_params *params);

/* The next conversion of a plant whose ADC is off: codes from the middle, and the truth at its trigger. */
struct plant_row bench_convert(struct plant *p, double codes[3]);

/* The bench's motor alone, turned to an electrical angle. */
struct motor bench_motor_at(double electrical_rad);
void bench_run_motor(struct motor *m, const struct motor_source *source, double duration_s);
/* A voltage vector of amplitude v along an electrical angle, as three phases see it. */
struct motor_source bench_vector(double v, double angle_rad);
extern const struct motor_source bench_open_terminals;

#define A_HIGH_BC_LOW (GATE_HIGH(0) | GATE_LOW(1) | GATE_LOW(2))
#define ALL_LOW       (GATE_LOW(0) | GATE_LOW(1) | GATE_LOW(2))

/* An inverter and the bench's motor without a fabric. */
struct bridge {
    struct inverter inv;
    struct motor m;
    sim_ps now;
};

struct bridge bridge_on_bench(const struct inverter_params *ip);
void bridge_gates(struct bridge *b, unsigned mask);
/* Integrates, letting the switches follow after their delays. */
void bridge_advance(struct bridge *b, double duration_s);
double bridge_current(const struct bridge *b, int phase); /* of the motor */

#endif

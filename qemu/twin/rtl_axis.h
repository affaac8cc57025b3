/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The verilated fabric_axis as a shared library: clocks and pins. The one function it exports is rtl_axis_open(). */
#ifndef TWIN_RTL_AXIS_H
#define TWIN_RTL_AXIS_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define RTL_AXIS_VERSION 5

/* clang-format off */
/* Pins by the names of fabric_axis.v. Bits of sdata: bus voltage C B A; of hall, high and low: C B A. */
#define RTL_INPUTS(X) \
    X(bool, rst_n) X(bool, psel) X(bool, penable) X(bool, pwrite) X(uint16_t, paddr) X(uint32_t, pwdata) \
    X(bool, pin_overcurrent) X(bool, pin_driver_fault) X(bool, pin_sto_a_n) X(bool, pin_sto_b_n) X(bool, pin_clock_ok) \
    X(uint8_t, pin_sdata) X(uint8_t, pin_hall) X(bool, pin_temp_sdata) X(bool, pin_a) X(bool, pin_b) X(bool, pin_index) \
    X(bool, pin_lost)
#define RTL_OUTPUTS(X) \
    X(uint32_t, prdata) X(uint8_t, pin_high) X(uint8_t, pin_low) X(bool, pin_chopper) X(bool, irq) X(bool, pin_cs_n) \
    X(bool, pin_sclk) X(bool, pin_temp_cs_n) X(bool, pin_temp_sclk)
/* Between the blocks; `sample`: a conversion has ended; `sto`: safe torque off in the next clock, apart B A. */
#define RTL_WIRES(X) X(bool, trigger) X(bool, live) X(bool, trip) X(bool, sample) X(uint8_t, sto)
#define RTL_FIELD(type, name) type name;
/* clang-format on */

struct rtl_inputs {
    RTL_INPUTS(RTL_FIELD)
};

struct rtl_outputs {
    RTL_OUTPUTS(RTL_FIELD) RTL_WIRES(RTL_FIELD)
};

/* Registers of the PWM, to tell how long it will decide nothing. */
struct rtl_pwm {
    uint32_t control, period, phase, dead, min_pulse, mode, trigger[2], count;
    uint32_t newest[3], compare[3], left[3];
    bool running, rising, waiting[3], fresh, side[3], on[3];
};

/* The same beside the PWM: clocks until something may happen behind them; 0: it does not by itself. */
struct rtl_beside {
    int64_t trip_in;    /* a new value of the modulators' fast path */
    int64_t results_in; /* the results of modulators, if a conversion runs or is triggered now */
    int64_t watch_in;   /* the program's next proof of life is late */
    int64_t sto_in;     /* an input of safe torque off has asked for long enough */
};

/* The modulators' clock has risen, so many clocks from the beginning of the run() on: their next bits, C B A. */
typedef unsigned rtl_bits(void *context, uint64_t clocks);

struct rtl_axis;

/* A motor in RTL (rtl_plant.h) at the pins of the axis, clocked with it: all pins of converters, encoder and Hall switches are
 * its own, whatever the inputs say. */
struct rtl_motor_calls {
    void (*put)(struct rtl_axis *axis, int place, int64_t word);
    int64_t (*get)(const struct rtl_axis *axis, int place);
    /* A register, in the next clocks. */
    void (*write)(struct rtl_axis *axis, uint32_t offset, uint32_t value);
};

struct rtl_axis_calls {
    unsigned version;
    bool in_en; /* pin_high are the legs' inputs, pin_low their enables */
    struct rtl_axis *(*create)(void);
    /* What the outputs are with these inputs, in the present clock. */
    void (*settle)(struct rtl_axis *axis, const struct rtl_inputs *in, struct rtl_outputs *out);
    /* At most so many clocks with still inputs; ends behind the first that changes an output. Returns how many it took. */
    uint64_t (*run)(struct rtl_axis *axis, uint64_t clocks, struct rtl_outputs *out);
    void (*look)(const struct rtl_axis *axis, struct rtl_pwm *pwm, struct rtl_beside *beside);
    /* Without, the modulators' lines are 0. */
    void (*modulate)(struct rtl_axis *axis, rtl_bits *bits, void *context);
    const struct rtl_motor_calls *motor; /* NULL: none */
};

const struct rtl_axis_calls *rtl_axis_open(void);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: GPL-2.0-or-later
// Names inside the verilated fabric_axis, which rtl_axis.vlt makes public, and what the parts of the library share.
#ifndef TWIN_RTL_NAMES_H
#define TWIN_RTL_NAMES_H

#include <cstdint>
#include <cstdlib>

#include "Vfabric_axis.h"
#include "Vfabric_axis___024root.h"
#include "rtl_axis.h"
#include "verilated.h"

struct rtl_motor;

using root_type = Vfabric_axis___024root;

struct rtl_axis {
    VerilatedContext context;
    Vfabric_axis top{&context, ""};
    rtl_outputs seen = {};
    int rest = 0;             /* clocks before the next try to take many at once */
    rtl_bits *bits = nullptr; /* of the modulators */
    void *bits_of = nullptr;
    rtl_motor *motor = nullptr; /* at its pins */
    bool checks = std::getenv("MSSFOC_EVERY_CLOCK") != nullptr;
};

#if VERILATOR_VERSION_INTEGER == 5006000
#define INNER_NAMES /* of this version are known: what evaluates the RTL */
void Vfabric_axis___024root___eval_nba(Vfabric_axis___024root *root);
void Vfabric_axis___024root___eval_settle(Vfabric_axis___024root *root);
#endif

#define WIRE(root, name)       (root)->fabric_axis__DOT__##name
#define PWM(root, name)        WIRE(root, carrier_and_legs__DOT__##name)
#define UPDATES(root, k, name) PWM(root, leg__BRA__##k##__KET____DOT__updates__DOT__##name)
#define BRIDGE(root, k, name)  PWM(root, leg__BRA__##k##__KET____DOT__half_bridge__DOT__##name)
#define ADC(root, name)        WIRE(root, sampler__DOT__##name)
#define FILTERS(root, name)    ADC(root, isolated__DOT__##name)
#define FILTER(root, k, name)  FILTERS(root, phase__BRA__##k##__KET____DOT__##name)
#define WATCH(root, name)      WIRE(root, bridge__DOT__program_watch__DOT__##name)
#define STO(root, name)        WIRE(root, safe_torque_off__DOT__##name)
#define LOW_FOR(root, k)       ADC(root, shunts__DOT__phase__BRA__##k##__KET____DOT__on_for)

static inline int64_t rtl_lesser(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

// A clock with still inputs, clk being 0 before and behind it.
void rtl_one_clock(Vfabric_axis &top);
// The next bits, after the modulators' clock has risen, so many clocks from the beginning of the run on.
void rtl_take_bits(rtl_axis *axis, uint64_t clocks);
// With a motor at its pins: as many clocks, at most, in which it shows nothing new there.
rtl_motor *rtl_motor_new(void);
uint64_t rtl_motor_rests(const rtl_axis *axis);
// So many clocks of the motor, with the axis' outputs of before them.
void rtl_motor_clocks(rtl_axis *axis, const rtl_outputs &before, uint64_t clocks);
// The motor's pins, in place of what the inputs say.
void rtl_motor_pins(rtl_axis *axis);
extern const rtl_motor_calls *const rtl_motor_functions;
// As many clocks as take no decision, `most` at most, and one at least; returns how many.
int64_t rtl_glide(rtl_axis *axis, uint64_t from, int64_t most);
void rtl_look(const rtl_axis *axis, rtl_pwm *pwm, rtl_beside *beside);

// Of the modulators' filters: clocks until one of their combs takes a value; 0 while one is at work.
int64_t rtl_filters_rest(const root_type *root);
// What the clock does to them while they rest, by their own registers alone.
void rtl_filters_clock(root_type *root);

#endif

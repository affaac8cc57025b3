// SPDX-License-Identifier: GPL-2.0-or-later
#include "rtl_axis.h"

#include "Vfabric_axis.h"
#include "Vfabric_axis___024root.h"
#include "verilated.h"

struct rtl_axis {
    VerilatedContext context;
    Vfabric_axis top{&context, ""};
    uint64_t seen = 0; /* outputs, as a key */
};

#if VERILATOR_VERSION_INTEGER == 5006000
void Vfabric_axis___024root___eval_nba(Vfabric_axis___024root *root);
#endif

namespace
{
/* A clock with still inputs, clk being 0 before and behind it. eval() would ask twice what the inputs have done and when the clock
 * rises; the version whose inner names are known here goes to the registers directly, half as long again as fast. */
void one_clock(Vfabric_axis &top)
{
#if VERILATOR_VERSION_INTEGER == 5006000
    top.rootp->__VnbaTriggered.at(0) = 1;
    Vfabric_axis___024root___eval_nba(top.rootp);
#else
    top.clk = 1;
    top.eval();
    top.clk = 0;
    top.eval();
#endif
}

void drive(Vfabric_axis &top, const rtl_inputs &in)
{
    top.rst_n = in.rst_n;
    top.psel = in.psel;
    top.penable = in.penable;
    top.pwrite = in.pwrite;
    top.paddr = in.paddr;
    top.pwdata = in.pwdata;
    top.sync_in = 0;
    top.pin_overcurrent = in.overcurrent;
    top.pin_driver_fault = in.driver_fault;
    top.pin_sto_a_n = in.sto_a_n;
    top.pin_sto_b_n = in.sto_b_n;
    top.pin_clock_ok = in.clock_ok;
    top.pin_sdata = in.sdata;
    top.pin_hall = in.hall;
    top.pin_temp_sdata = in.temp_sdata;
    top.pin_mod_data = 0;
    top.pin_a = in.a;
    top.pin_b = in.b;
    top.pin_index = in.index;
    top.pin_lost = in.lost;
}

/* All of them in two words, to see at once whether one has changed. */
uint64_t key_of(const Vfabric_axis &top)
{
    const Vfabric_axis___024root *root = top.rootp;
    return (uint64_t)top.prdata << 32 | (uint32_t)top.pin_high << 16 | (uint32_t)top.pin_low << 8 |
           (uint32_t)top.pin_chopper << 7 | (uint32_t)top.irq << 6 | (uint32_t)top.pin_cs_n << 5 |
           (uint32_t)top.pin_sclk << 4 | (uint32_t)top.pin_temp_cs_n << 3 | (uint32_t)top.pin_temp_sclk << 2 |
           (uint32_t)root->fabric_axis__DOT__trigger << 1 | root->fabric_axis__DOT__live;
}

rtl_outputs outputs(const Vfabric_axis &top)
{
    const Vfabric_axis___024root *root = top.rootp;
    rtl_outputs out = {};
    out.prdata = top.prdata;
    out.high = top.pin_high;
    out.low = top.pin_low;
    out.chopper = top.pin_chopper;
    out.irq = top.irq;
    out.cs_n = top.pin_cs_n;
    out.sclk = top.pin_sclk;
    out.temp_cs_n = top.pin_temp_cs_n;
    out.temp_sclk = top.pin_temp_sclk;
    out.trigger = root->fabric_axis__DOT__trigger;
    out.live = root->fabric_axis__DOT__live;
    return out;
}

rtl_axis *create()
{
    return new rtl_axis;
}

void settle(rtl_axis *axis, const rtl_inputs *in, rtl_outputs *out)
{
    drive(axis->top, *in);
    axis->top.clk = 0;
    axis->top.eval();
    axis->seen = key_of(axis->top);
    *out = outputs(axis->top);
}

uint64_t run(rtl_axis *axis, uint64_t clocks, rtl_outputs *out)
{
    Vfabric_axis &top = axis->top;
    uint64_t n = 0, key = axis->seen;
    while (n < clocks && key == axis->seen) {
        one_clock(top);
        n++;
        key = key_of(top);
    }
    axis->seen = key;
    *out = outputs(top);
    return n;
}

#define PWM(name)      root->fabric_axis__DOT__carrier_and_legs__DOT__##name
#define CARRIER(name)  PWM(carrier__DOT__##name)
#define UPDATES(k, name) PWM(leg__BRA__##k##__KET____DOT__updates__DOT__##name)
#define BRIDGE(k, name)  PWM(leg__BRA__##k##__KET____DOT__half_bridge__DOT__##name)
#define LOOK_AT_LEG(k)                                                                                                 \
    pwm->compare[k] = UPDATES(k, compare);                                                                             \
    pwm->waiting[k] = UPDATES(k, waiting);                                                                             \
    pwm->side[k] = BRIDGE(k, side);                                                                                    \
    pwm->on[k] = BRIDGE(k, on);                                                                                        \
    pwm->left[k] = BRIDGE(k, left)

void look(const rtl_axis *axis, rtl_pwm *pwm)
{
    const Vfabric_axis___024root *root = axis->top.rootp;
    pwm->control = (uint32_t)PWM(run) | (uint32_t)PWM(brake) << 1;
    pwm->period = PWM(period);
    pwm->phase = PWM(phase);
    pwm->dead = PWM(dead);
    pwm->min_pulse = PWM(min_pulse);
    pwm->mode = PWM(mode);
    pwm->trigger[0] = PWM(trigger_1);
    pwm->trigger[1] = PWM(trigger_2);
    pwm->newest[0] = PWM(compare_a);
    pwm->newest[1] = PWM(compare_b);
    pwm->newest[2] = PWM(compare_c);
    pwm->count = CARRIER(count);
    pwm->running = CARRIER(running);
    pwm->rising = CARRIER(rising);
    pwm->fresh = UPDATES(0, fresh);
    LOOK_AT_LEG(0);
    LOOK_AT_LEG(1);
    LOOK_AT_LEG(2);
}
} // namespace

const rtl_axis_calls *rtl_axis_open(void)
{
    static const rtl_axis_calls calls = {RTL_AXIS_VERSION, create, settle, run, look};
    return &calls;
}

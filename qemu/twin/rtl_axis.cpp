// SPDX-License-Identifier: GPL-2.0-or-later
#include "rtl_axis.h"

#include <cstring>

#include "rtl_names.h"

/* eval() would ask twice what the inputs have done and when the clock rises. */
void rtl_one_clock(Vfabric_axis &top)
{
#ifdef INNER_NAMES
    top.rootp->__VnbaTriggered.at(0) = 1;
    Vfabric_axis___024root___eval_nba(top.rootp);
    top.rootp->__VnbaTriggered.at(0) = 0;
#else
    top.clk = 1;
    top.eval();
    top.clk = 0;
    top.eval();
#endif
}

void rtl_take_bits(rtl_axis *axis, uint64_t clocks)
{
    if (axis->bits) {
        axis->top.pin_mod_data = (uint8_t)axis->bits(axis->bits_of, clocks);
    }
}

namespace
{
/* Zeroed first, so that two of them compare as memory. */
void read_outputs(const Vfabric_axis &top, rtl_outputs *out)
{
    const root_type *root = top.rootp;
    std::memset(out, 0, sizeof *out);
#define READ_PORT(type, name) out->name = top.name;
#define READ_WIRE(type, name) out->name = WIRE(root, name);
    RTL_OUTPUTS(READ_PORT)
    RTL_WIRES(READ_WIRE)
}

rtl_axis *create()
{
    rtl_axis *axis = new rtl_axis;
    axis->motor = rtl_motor_new();
    return axis;
}

void settle(rtl_axis *axis, const rtl_inputs *in, rtl_outputs *out)
{
    Vfabric_axis &top = axis->top;
#define DRIVE_PORT(type, name) top.name = in->name;
    RTL_INPUTS(DRIVE_PORT)
    if (axis->motor) {
        rtl_motor_pins(axis);
    }
    top.sync_in = 0;
    top.clk = 0;
    top.eval();
    read_outputs(top, &axis->seen);
    *out = axis->seen;
}

uint64_t one_clock(rtl_axis *axis, uint64_t from)
{
    bool was_high = axis->top.pin_mod_clock;
    rtl_one_clock(axis->top);
    if (axis->top.pin_mod_clock && !was_high) {
        rtl_take_bits(axis, from + 1);
    }
    return 1;
}

/* At most so many clocks, the first of them `from` behind the beginning of the run. */
uint64_t advance(rtl_axis *axis, uint64_t from, uint64_t most)
{
    if (axis->rest > 0) {
        axis->rest--;
        return one_clock(axis, from);
    }
    int64_t glided = rtl_glide(axis, from, (int64_t)most);
    return glided == 0 ? one_clock(axis, from) : (uint64_t)glided;
}

uint64_t run(rtl_axis *axis, uint64_t clocks, rtl_outputs *out)
{
    const rtl_outputs before = axis->seen;
    uint64_t n = 0;
    while (n < clocks && std::memcmp(&before, &axis->seen, sizeof before) == 0) {
        uint64_t left = clocks - n, rests = axis->motor ? rtl_motor_rests(axis) : left;
        uint64_t took = advance(axis, n, rests < left ? rests : left);
        if (axis->motor) {
            rtl_motor_clocks(axis, before, took);
        }
        n += took;
        read_outputs(axis->top, &axis->seen);
    }
    *out = axis->seen;
    return n;
}

void modulate(rtl_axis *axis, rtl_bits *bits, void *context)
{
    axis->bits = bits;
    axis->bits_of = context;
}
} // namespace

const rtl_axis_calls *rtl_axis_open(void)
{
    static const rtl_axis_calls calls = {RTL_AXIS_VERSION,   IN_EN, create, settle, run, rtl_look, modulate,
                                         rtl_motor_functions};
    return &calls;
}

// SPDX-License-Identifier: GPL-2.0-or-later
// The motor in RTL at the pins of the axis, both with one clock. Without it, a library of the axis alone has rtl_no_motor.cpp.
#include <deque>
#include <utility>

#include "rtl_names.h"
#include "rtl_plant.h"

struct rtl_motor {
    rtl_plant *plant = rtl_plant_new();
    rtl_plant_out pins = {};
    std::deque<std::pair<uint32_t, uint32_t>> writes; // registers
};

rtl_motor *rtl_motor_new(void)
{
    return new rtl_motor;
}

void rtl_motor_pins(rtl_axis *axis)
{
    Vfabric_axis &top = axis->top;
    const rtl_plant_out &pins = axis->motor->pins;
    top.pin_sdata = pins.sdata;
    top.pin_temp_sdata = pins.temp_sdata;
    top.pin_a = pins.a;
    top.pin_b = pins.b;
    top.pin_index = pins.index;
    top.pin_lost = pins.lost;
    top.pin_hall = pins.hall;
}

static bool same(const rtl_plant_out &a, const rtl_plant_out &b)
{
    return a.sdata == b.sdata && a.hall == b.hall && a.temp_sdata == b.temp_sdata && a.a == b.a && a.b == b.b &&
           a.index == b.index && a.lost == b.lost;
}

uint64_t rtl_motor_rests(const rtl_axis *axis)
{
    const rtl_motor *m = axis->motor;
    bool converts = !axis->top.pin_cs_n || !axis->top.pin_temp_cs_n;
    return converts || !m->writes.empty() ? 1 : rtl_plant_rests(m->plant);
}

void rtl_motor_clocks(rtl_axis *axis, const rtl_outputs &out, uint64_t clocks)
{
    rtl_motor *m = axis->motor;
    const rtl_plant_in in = {out.pin_high, out.pin_low,       out.pin_chopper,  out.pin_cs_n,
                             out.pin_sclk, out.pin_temp_cs_n, out.pin_temp_sclk};
    const rtl_plant_out before = m->pins;
    if (!m->writes.empty()) {
        if (rtl_plant_transfer(m->plant, &in, &m->pins, m->writes.front().first, m->writes.front().second)) {
            m->writes.pop_front();
        }
    } else {
        rtl_plant_clocks(m->plant, &in, clocks);
        rtl_plant_look(m->plant, &m->pins);
    }
    if (!same(before, m->pins)) {
        rtl_motor_pins(axis);
        axis->top.eval();
    }
}

namespace
{
void put(rtl_axis *axis, int place, int64_t word)
{
    rtl_plant_put(axis->motor->plant, place, word);
}

int64_t get(const rtl_axis *axis, int place)
{
    return rtl_plant_get(axis->motor->plant, place);
}

void write(rtl_axis *axis, uint32_t offset, uint32_t value)
{
    axis->motor->writes.emplace_back(offset, value);
}

const rtl_motor_calls calls = {put, get, write};
} // namespace

const rtl_motor_calls *const rtl_motor_functions = &calls;

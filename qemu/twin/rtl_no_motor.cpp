// SPDX-License-Identifier: GPL-2.0-or-later
// In a library of the axis alone, in place of rtl_motor.cpp.
#include "rtl_names.h"

rtl_motor *rtl_motor_new(void)
{
    return nullptr;
}

uint64_t rtl_motor_rests(const rtl_axis *)
{
    return UINT64_MAX;
}

void rtl_motor_clocks(rtl_axis *, const rtl_outputs &, uint64_t)
{
}

void rtl_motor_pins(rtl_axis *)
{
}

const rtl_motor_calls *const rtl_motor_functions = nullptr;

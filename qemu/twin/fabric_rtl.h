/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The fabric as its RTL, verilated into a shared library (rtl_axis.h) and clocked at 100 MHz; at its pins two AD7356 and an
 * AD7476A, isolated modulators if sensor.modulators says so, the lines of encoder and Hall switches, and the inputs that
 * stop. */
#ifndef TWIN_FABRIC_RTL_H
#define TWIN_FABRIC_RTL_H

#include "fabric.h"
#include "sensor_keys.h"

/* Loads the library. On failure says so in one line and ends the process. */
struct fabric *fabric_rtl_open(const char *path, const struct sensor_params *sensors, bool in_en, uint64_t seed);

#endif

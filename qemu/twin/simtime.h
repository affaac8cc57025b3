/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Simulated time: picoseconds since power-on in 64 bits (106 days). Integer, so that two events that belong to the
 * same clock edge compare equal and a run repeats to the byte. */
#ifndef TWIN_SIMTIME_H
#define TWIN_SIMTIME_H

#include <math.h>
#include <stdint.h>

typedef int64_t sim_ps;

#define SIM_PS_PER_NS           1000
#define SIM_PS_PER_FABRIC_CLOCK 10000 /* docs/fabric.md: 100 MHz */
#define SIM_NEVER               INT64_MAX

static inline double sim_to_s(sim_ps t)
{
    return (double)t * 1e-12;
}

static inline sim_ps sim_from_s(double t_s)
{
    return (sim_ps)llround(t_s * 1e12);
}

/* The double that the time's decimal form in whole nanoseconds stands for, so that what is recorded compares with the
 * times of a scenario as one expects. */
static inline double sim_recorded_s(double t_s)
{
    return (double)llround(t_s * 1e9) / 1e9;
}

/* The first whole nanosecond that is not before t: QEMU's clock has no finer grain. */
static inline int64_t sim_to_ns_up(sim_ps t)
{
    return (t + SIM_PS_PER_NS - 1) / SIM_PS_PER_NS;
}

#endif

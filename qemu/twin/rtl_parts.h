/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What the parts of the fabric as RTL share: fabric_rtl.c is the seam to the plant, rtl_clock.c clocks the RTL and plays what
 * is at its pins, rtl_ahead.c tells how long it decides nothing. */
#ifndef TWIN_RTL_PARTS_H
#define TWIN_RTL_PARTS_H

#include "converter.h"
#include "fabric_rtl.h"
#include "lines.h"
#include "pwm.h"
#include "rtl_axis.h"

#define RTL_EVENTS_ROOM 256 /* a power of two */
#define RTL_STOP_CLOCKS 4   /* from a pin that stops, or the modulators' trip, to its latch */

/* The wires behind a clock that changed one of them. */
struct rtl_change {
    int64_t clock;
    unsigned gates;
    bool live, chops, interrupt, triggered, converted;
};

struct fabric_rtl {
    struct fabric fabric;
    const struct rtl_axis_calls *calls;
    struct rtl_axis *axis;
    int64_t clock;
    struct rtl_inputs in;
    struct rtl_outputs out;
    struct pwm promise;
    struct rtl_beside beside;
    bool promised; /* since nothing has happened to the RTL */
    struct rtl_change event[RTL_EVENTS_ROOM];
    unsigned first, count;
    struct converter converter[4], thermometer;
    uint32_t code[4];
    bool modulated; /* the currents' lines of the converters are at 0 */
    struct bit_streams bits;
    bool enabled;
    int64_t finish;                  /* the clock in which a conversion ends; INT64_MAX: none runs */
    int64_t sampled_at, chopper_due; /* of the chopper: its newest sample, and when it may follow it */
    int64_t stops_until;             /* what stops is on its way to the latches */
    int64_t trip_at;                 /* the next value of the modulators' fast path; INT64_MAX: none */
    bool tripped;                    /* by the last of them */
    uint8_t sto;                     /* as it was */
    int64_t watch_at;                /* the watch over the program may trip; INT64_MAX: it does not watch */
    int64_t sto_at;                  /* safe torque off may stop; INT64_MAX: no input asks */
    struct lines lines;
    uint32_t id_xor;
    struct rtl_motor_state *motor; /* rtl_motor.c; NULL: none in RTL */
};

static inline struct fabric_rtl *rtl_of(struct fabric *f)
{
    return (struct fabric_rtl *)f;
}

static inline int64_t rtl_lesser(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

static inline sim_ps rtl_time_of(int64_t clock)
{
    return clock == INT64_MAX ? SIM_NEVER : clock * SIM_PS_PER_FABRIC_CLOCK;
}

__attribute__((noreturn)) void rtl_fail(const char *what, const char *why);

/* ---- rtl_clock.c ---- */

void rtl_attach(struct fabric_rtl *r);
/* What the outputs are with the inputs as they are now. */
void rtl_settle(struct fabric_rtl *r);
/* Lists a change of the wires behind the present clock, if there is one. */
void rtl_look(struct fabric_rtl *r);
/* Up to clock `to`, but not beyond a change of the wires that the plant has to see. */
void rtl_clock_to(struct fabric_rtl *r, int64_t to);
/* One transfer on the bus, whatever happens meanwhile; returns what was read. */
uint32_t rtl_transfer(struct fabric_rtl *r, bool writes, uint32_t offset, uint32_t value);
/* One clock in reset. */
void rtl_reset_clock(struct fabric_rtl *r);

/* ---- rtl_ahead.c ---- */

/* The RTL's registers that say how far nothing happens, as of now. */
const struct pwm *rtl_promise(struct fabric_rtl *r);
/* The clock of the next event: one that is listed, or the first in which something may be decided. */
int64_t rtl_next_clock(struct fabric_rtl *r);
/* Where the conversion that the last trigger starts, or that runs, will end, is known from here on. */
void rtl_expect_results(struct fabric_rtl *r);

#endif

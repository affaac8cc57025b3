/* SPDX-License-Identifier: MIT */
/*
 * What motor this is, from the inverter's ratings and the rated current alone. It goes in steps, each with its file: the slow
 * loop measures, bridge on; when a step has its sums it holds no voltage and the thread works out what they mean, and how the
 * next step is to measure. So no division is ever in an interrupt, and each step is tuned by what those before it found.
 *
 *   identify_rough.c        a first inductance from pulses, a first resistance from a current that stands
 *   identify_resistance.c   resistance, and what dead time costs beyond what is compensated
 *   identify_inductance.c   the axes, and the inductance along each, for small changes
 *
 * A result is known, with the interval in which it lies in 95 % of all cases, or it is refused with a reason. Nothing is
 * guessed, and nothing becomes a parameter by itself: identify_use().
 *
 * The interval is 2 sqrt(s^2 + sum a^2 / 3): s, the standard deviation of the mean; a, the bound of each systematic error,
 * most of all of the sensors' gains, which no measurement with these sensors can see (GUM, JCGM 100:2008, 4.3.7 and 6.2).
 */
#ifndef FIRMWARE_COMMISSION_IDENTIFY_H
#define FIRMWARE_COMMISSION_IDENTIFY_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/fabric/adc.h"
#include "firmware/commission/identify_burst.h"
#include "firmware/control/current_loop.h"
#include "firmware/settings/error.h"
#include "firmware/settings/params.h"
#include "firmware/settings/tuning.h"

enum identify_quantity {
    IDENTIFY_RESISTANCE, /* uohm, one phase and the switches in its way, as warm as they are */
    IDENTIFY_DEAD_TIME,  /* 0.1 ns, effective: what a leg loses in a period, in time at the bus voltage */
    IDENTIFY_LD,         /* nH, for small changes, no current otherwise */
    IDENTIFY_LQ,         /* nH */
    IDENTIFY_QUANTITIES
};

enum identify_state {
    IDENTIFY_UNKNOWN, /* not reached yet */
    IDENTIFY_KNOWN,
    IDENTIFY_REFUSED,
};

enum identify_reason {
    IDENTIFY_NO_REASON,
    IDENTIFY_STOPPED,       /* before it was this one's turn: off, or a fault */
    IDENTIFY_RATED_SMALL,   /* rated current too small for the sensors' range */
    IDENTIFY_NO_CURRENT,    /* a tenth of the bus drives next to none */
    IDENTIFY_NOT_RESISTIVE, /* voltage does not grow with current: contacts, a rotor that moves */
    IDENTIFY_TURNED,        /* reluctance turns the rotor whenever the current changes */
    IDENTIFY_SCATTER,       /* repeated measurements differ by more than a tenth */
    IDENTIFY_REASONS
};

struct identify_result {
    uint32_t state;   /* enum identify_state */
    uint32_t reason;  /* enum identify_reason, of a refused one */
    int32_t value;    /* in the quantity's unit */
    int32_t interval; /* it lies within +-this of the value in 95 % of cases */
};

enum identify_step {
    IDENTIFY_STEP_NONE,
    IDENTIFY_STEP_PULSES,
    IDENTIFY_STEP_HOLD,
    IDENTIFY_STEP_RESISTANCE,
    IDENTIFY_STEP_AXES,
    IDENTIFY_STEP_INDUCTANCE,
    IDENTIFY_STEP_DONE,
    IDENTIFY_STEPS
};

#define IDENTIFY_LEVELS 10 /* of current: tenths of the rated one */
#define IDENTIFY_ANGLES 6  /* of 60 degrees: both signs along each phase */
#define IDENTIFY_AXES   16 /* angles over half a turn */

/* Sensors' gains: what nobody who measures with them can know better. Bounds, in thousandths. */
#define IDENTIFY_CURRENT_GAIN_PERMILLE 15
#define IDENTIFY_BUS_GAIN_PERMILLE     7

struct identify_pulses {
    uint32_t count; /* bursts at the final height */
    uint32_t angle;
    struct burst_sums sums[3]; /* one for each angle */
};

struct identify_hold {
    int64_t v_sum; /* steps times bus voltage, Q15 */
    int32_t i_sum_q15, count;
};

struct identify_resistance {
    uint32_t angle, visit, ms;
    bool moving;                                        /* the field goes to its next angle, and the rotor with it */
    int64_t v_sum[2][IDENTIFY_ANGLES][IDENTIFY_LEVELS]; /* on the way down and up */
    int64_t vbus_sum_q15;
};

enum identify_pass {
    IDENTIFY_HELD, /* the rotor, by a current */
    IDENTIFY_FREE,
    IDENTIFY_PASSES
};

struct identify_axes_sums {
    int64_t re, im, straight; /* of responses, turned back by twice the angle; and along the voltage */
};

struct identify_axes {
    uint32_t pass, angle, burst;
    int32_t held_steps, free_steps; /* heights of the wave */
    struct identify_axes_sums sums[IDENTIFY_PASSES];
    int32_t this_d, this_q;
};

struct identify_inductance {
    uint32_t bursts;
    struct burst_sums sums[2][2]; /* of d and q, each in two halves: what they differ by tells how sure it is */
};

struct identify {
    volatile uint32_t step; /* enum identify_step: the thread moves it on while `thinking` */
    volatile bool thinking; /* the slow loop has measured, the thread's turn */
    volatile bool running;
    uint32_t stopped_in; /* enum identify_step: where it ended; DONE, or by a fault or `off` */
    uint32_t fault;      /* enum fault that ended it, 0: none */
    uint32_t ms;         /* in this step */
    uint32_t total_ms;
    struct params params; /* what is known so far, and inverter's; for tuning */
    struct tuning tuning; /* of the current loop meanwhile */
    int32_t i_rated_q15;
    uint32_t settle_ms; /* until nothing is left of a step of current that iron and rotor answer slowly */
    /* what the steps found, for those after them */
    struct burst burst;
    uint32_t axis_q32; /* field's angle of the magnets, or half a turn more */
    bool reluctant;    /* one inductance is twice the other, or more */
    struct identify_result results[IDENTIFY_QUANTITIES];
    /* what the steps measure */
    struct identify_pulses pulses;
    struct identify_hold hold;
    struct identify_resistance resistance;
    struct identify_axes axes;
    struct identify_inductance inductance;
};

/*
 * Before the first step: what `p` says of the inverter, and its i_rated_ma. ERROR_NONE, or why this inverter's ratings do
 * not go together. Results from before are forgotten. Thread, bridge off.
 */
struct outcome identify_begin(struct identify *d, const struct params *p);

/* One millisecond. True when all is done, or nothing more can be: the bridge may go off. Slow loop, bridge on, wired well. */
bool identify_step(struct identify *d, volatile struct current_loop *c, const struct adc_regs *adc);

/* What current_loop_follow() is to be given. Slow loop. */
const struct tuning *identify_tuning(const struct identify *d);

/* Works out what has been measured, when there is something. Thread, often. */
void identify_think(struct identify *d);

/* It ends here, by `fault` or (0) by a request. Any context. */
void identify_stop(struct identify *d, uint32_t fault);

/* Takes what is known into `p`; returns how many parameters have changed. Thread, bridge off. */
uint32_t identify_use(const struct identify *d, struct params *p);

#endif

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Fabric slot 0: carrier, compares, legs and triggers (docs/fabric.md), clock by clock as the RTL's, but only in those clocks
 * in which something is decided; in between counters are moved all at once. */
#ifndef TWIN_PWM_H
#define TWIN_PWM_H

#include <stdbool.h>
#include <stdint.h>

#include "simtime.h"

#define PWM_COMPARE_C_OFFSET 0x30u

struct pwm_leg {
    bool side; /* high */
    bool on;
    uint32_t left; /* clocks, this one included, until something may change */
    bool active;   /* it has turned on since it was enabled */
};

struct pwm_compare {
    uint32_t written, active;
    bool waiting, fell_back;
};

struct pwm {
    const struct pwm *leader; /* the one that FOLLOW waits for; NULL: this is axis 0, which waits for none */
    uint32_t control, period, dead, min_pulse, mode, phase, trigger[2];
    struct pwm_compare compare[3];
    bool fresh; /* the clock after a commit */
    struct pwm_leg leg[3];
    bool running, rising;
    uint32_t count;
    bool live;          /* from GATE */
    unsigned outputs;   /* bit 2k the high side of phase k, bit 2k+1 its low side */
    unsigned led;       /* the same of drivers that have an input and an enable for each leg, but for their dead time */
    bool at_valley;     /* the last step has ended a period */
    int64_t clock;      /* of this state, since time 0 */
    int64_t rested_at;  /* when the carrier came to rest */
    int64_t next_clock; /* of the next event; INT64_MAX: none */
    bool next_triggers; /* and that is a trigger */
    sim_ps valley_at;   /* the last one, or where the carrier started */
};

void pwm_reset(struct pwm *p, sim_ps now);

/* Registers at the time of the last pwm_catch_up(). */
uint32_t pwm_read(const struct pwm *p, uint32_t offset);
void pwm_write(struct pwm *p, uint32_t offset, uint32_t value);
/* Whether GATE lets the legs turn on, from now on. */
void pwm_set_live(struct pwm *p, bool live);

/* Moves to `now`, before which no event may be due. */
void pwm_catch_up(struct pwm *p, sim_ps now);
/* Time of the next event, of which outputs may change; SIM_NEVER: nothing comes by itself. */
sim_ps pwm_next_event(const struct pwm *p);
/* Takes the event at that time. True: it triggers the ADC. */
bool pwm_take_event(struct pwm *p);
bool pwm_triggers_next(const struct pwm *p);
/* Time of the next trigger, or earlier. */
sim_ps pwm_next_trigger(const struct pwm *p);
/* FOLLOW holds the carrier back. Until it has started, the leader must not come further than this PWM has. */
bool pwm_waits(const struct pwm *p);
/* After its state was filled in from outside: finds the next event again. */
void pwm_plan(struct pwm *p);

#endif

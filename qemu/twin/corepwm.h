/* SPDX-License-Identifier: GPL-2.0-or-later */
/* CorePWM 4.3 with seven shadowed outputs, as docs/fabric.md configures it. */
#ifndef TWIN_COREPWM_H
#define TWIN_COREPWM_H

#include <stdbool.h>
#include <stdint.h>

#include "simtime.h"

#define COREPWM_CHANNELS    7
#define COREPWM_SYNC_UPDATE 0xE4u

struct corepwm_registers {
    uint32_t prescale, period, enable;
    uint32_t pos_edge[COREPWM_CHANNELS], neg_edge[COREPWM_CHANNELS];
};

struct corepwm_edge {
    uint32_t count;
    unsigned rise, fall, toggle; /* masks of channels */
};

struct corepwm {
    struct corepwm_registers pending, active;
    bool sync_update;
    unsigned outputs; /* bit n is output n+1 */
    sim_ps period_start;
    struct corepwm_edge edges[2 * COREPWM_CHANNELS]; /* of the running period, in order */
    int edge_count, next_edge;
};

void corepwm_reset(struct corepwm *c, sim_ps now);
/* Registers at time now; events up to now must have been taken. */
uint32_t corepwm_read(const struct corepwm *c, uint32_t offset);
void corepwm_write(struct corepwm *c, uint32_t offset, uint32_t value);

/* Skips whole periods in which nothing can happen. */
void corepwm_catch_up(struct corepwm *c, sim_ps now);
/* Time of the next change of the core: an edge or the end of the period. SIM_NEVER while all is off and stays off. */
sim_ps corepwm_next_event(const struct corepwm *c);
/* Takes the event at that time. */
void corepwm_take_event(struct corepwm *c);
/* Whether output `channel` (0 based) may rise with the next event. */
bool corepwm_may_rise_next(const struct corepwm *c, int channel);
/* Earliest time at which output `channel` can rise, no later than the truth: the end of the period if the present one
 * holds no such edge. */
sim_ps corepwm_next_rise(const struct corepwm *c, int channel);

#endif

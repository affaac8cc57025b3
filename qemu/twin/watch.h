/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The watch over the program in fabric slot 3 (docs/fabric.md): the current loop's compares, and the proofs that slow loop and
 * thread write by turns. */
#ifndef TWIN_WATCH_H
#define TWIN_WATCH_H

#include <stdbool.h>
#include <stdint.h>

#include "simtime.h"

struct watch {
    bool started;
    uint32_t clocks;
    bool thread; /* whose turn it is */
    uint8_t number;
    bool armed;    /* the program has written ENABLE, with effect, and missed nothing since */
    bool answered; /* the loop, in this period of the carrier */
    sim_ps late_at;
};

void watch_reset(struct watch *w);
/* Starts it, unless it runs or is armed. */
void watch_start(struct watch *w, uint32_t clocks);
/* What a write to ENABLE came to. `was_live`: before it. */
void watch_arm(struct watch *w, bool armed, bool was_live, sim_ps now);
/* The program has missed a proof: until it is armed again nothing more happens. */
void watch_disarm(struct watch *w);
/* A word; returns whether it is missed, being another than the next. */
bool watch_prove(struct watch *w, uint32_t word, sim_ps now);
/* The carrier passes its valley; returns whether the loop gave no set of compares in the period before. */
bool watch_valley(struct watch *w);

#endif

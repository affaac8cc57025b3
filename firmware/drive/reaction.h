/* SPDX-License-Identifier: MIT */
/*
 * Reactions to faults that the slow loop reports, selectable for each: off, controlled stop, warning, failover. Faults found by
 * hardware or the current loop always switch off (fault/fault.h).
 */
#ifndef FIRMWARE_DRIVE_REACTION_H
#define FIRMWARE_DRIVE_REACTION_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/fault/fault.h"
#include "firmware/settings/error.h"

struct axis;

struct reactions {
    uint8_t choice[FAULT_COUNT]; /* enum reaction: the thread's, bridge off */
    uint32_t gain_reductions;    /* how often a limit cycle has reduced the speed loop's gains since `on` */
    volatile bool stopping;      /* a fault is latched, and a quick stop is under way: the slow loop's */
};

/* The initial choice of each fault. Thread, once. */
void reaction_init(struct reactions *r);

/* Carries out the chosen reactions to what was reported in this step. Slow loop, last. */
void reaction_step(struct axis *a);

/* Sets a choice, or refuses one that the fault's class does not allow. Thread, bridge off. */
struct outcome drive_choose_reaction(struct axis *a, enum fault cause, enum reaction choice);

#endif

/* SPDX-License-Identifier: MIT */
/*
 * What the drive does about a fault: the choice for each (off, controlled stop, warning), and whether it retries by itself.
 *
 * Only faults found by the slow loop leave a choice. What hardware or the current loop finds is raised (axis_raise): off.
 */
#ifndef FIRMWARE_AXIS_REACTION_H
#define FIRMWARE_AXIS_REACTION_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/axis/fault.h"
#include "firmware/settings/error.h"

struct axis;

#define REACTION_WORDS ((FAULT_COUNT + 31u) / 32u)

struct reactions {
    uint8_t choice[FAULT_COUNT];                /* enum reaction */
    volatile uint32_t warnings[REACTION_WORDS]; /* one bit per fault that was only a warning, since `on` */
    volatile bool stopping;                     /* a fault is latched, and a quick stop is under way */
    bool wanted;                                /* the operator's last word is "operate": `on`, or all enable bits */
    uint32_t retries;                           /* since the last 10 s of good operation, or a person's `clear` */
    uint32_t latched_ms;                        /* when the thread saw the fault that may be retried */
    bool waiting;                               /* to retry */
    bool switching_on;                          /* cleared without a person, `on` is due */
    bool resumes;                               /* speed control resumes towards the speed last asked for: */
    int32_t resume_rpm_q16;
    uint32_t good_since_ms;
};

/* The initial choice of each fault. Thread, once. */
void reaction_init(struct reactions *r);

/* Carries out the chosen reaction to a fault found by the slow loop. Slow loop. */
void axis_report(struct axis *a, enum fault cause, int32_t detail_0, int32_t detail_1);

/* Only warns. Slow loop. */
void axis_warn(struct axis *a, enum fault cause);

/* Sets a choice, or refuses one that the fault's class does not allow. Thread, bridge off. */
struct outcome axis_choose_reaction(struct axis *a, enum fault cause, enum reaction choice);

/* True if a fault was a warning since `on`. Any context. */
bool reaction_warned(const struct reactions *r, enum fault cause);

/* Forgets the warnings. Slow loop, at `on`. */
void reaction_begin(struct reactions *r);

/*
 * The operator no longer wants operation: `off`, quick stop, `clear`, or a control word without all enable bits. From here on
 * the drive does not switch on by itself, whatever it was waiting for. Thread.
 */
void reaction_withdraw(struct reactions *r);

/* A person has cleared the fault: the same, and the retry count starts over. Thread. */
void reaction_cleared_by_hand(struct reactions *r);

/*
 * The initial target speed of operation, rpm Q16: 0, or the one asked for before the rotor was lost, if the drive has switched
 * on again by itself because of that. Once. Slow loop.
 */
int32_t reaction_take_target(struct reactions *r);

/*
 * Retry policy: clears what may be cleared and switches on again when it is time, as long as the operator wants it (`wanted`).
 * Thread, whenever it has time.
 */
void axis_retry(struct axis *a);

#endif

/* SPDX-License-Identifier: MIT */
#include "firmware/drive/reaction.h"

#include "firmware/axis/axis.h"
#include "firmware/drive/failover.h"
#include "firmware/drive/retune.h"

#define GAIN_REDUCTIONS_MAX 5u /* by 0.7 each: tolerates an inertia parameter five times too large */

void reaction_init(struct reactions *r)
{
    *r = (struct reactions){.stopping = false};
    fault_default_reactions(r->choice);
}

static bool can_stop(const struct axis *a)
{
    return a->state == AXIS_OPERATION_ENABLED || a->state == AXIS_QUICK_STOP;
}

/* If failover is not possible: the mildest other reaction of the class that does not need the encoder. */
static enum reaction choice_now(struct axis *a, enum fault cause)
{
    const enum reaction choice = (enum reaction)a->reactions.choice[cause];
    if (cause == FAULT_OSCILLATION && choice == REACTION_CARRY) {
        return a->speed.oscillation.answered < OSCILLATION_ANSWERS_MOST ? REACTION_WARN : REACTION_OFF;
    }
    if (choice != REACTION_CARRY || a->failover.pending != FAULT_NONE || failover_begin(a, cause)) {
        return choice;
    }
    return ((fault_class(cause)->allowed >> REACTION_STOP) & 1u) != 0u ? REACTION_STOP : REACTION_OFF;
}

/* The likely cause of a limit cycle is an inertia parameter that is too large. False if lower gains have not helped. */
static bool reduce_speed_gain(struct axis *a)
{
    if (a->reactions.gain_reductions == GAIN_REDUCTIONS_MAX) {
        return false;
    }
    a->reactions.gain_reductions++;
    retune_reduced_gains(a);
    return true;
}

static void react(struct axis *a, const struct fault_report *r)
{
    const enum fault cause = failover_blame(a, r->cause);
    if (cause == FAULT_LIMIT_CYCLE && reduce_speed_gain(a)) {
        fault_warn(a, cause);
        return;
    }
    switch (choice_now(a, cause)) {
    case REACTION_CARRY:
        return; /* failover succeeded */
    case REACTION_WARN:
        fault_warn(a, cause);
        return;
    case REACTION_STOP:
        if (can_stop(a)) {
            const bool first = fault_latch(a, cause, r->detail[0], r->detail[1]);
            a->reactions.stopping = first || a->reactions.stopping;
            return;
        }
        break;
    default:
        break;
    }
    fault_raise_with(a, cause, r->detail[0], r->detail[1]);
}

void reaction_step(struct axis *a)
{
    for (uint32_t n = 0; n < a->reports.count; n++) {
        react(a, &a->reports.report[n]);
    }
    a->reports.count = 0;
}

/* SPDX-License-Identifier: MIT */
#include "firmware/drive/reaction.h"

#include "firmware/axis/axis.h"
#include "firmware/drive/failover.h"
#include "lib/q15.h"

#define SOFTENED_Q8   179 /* 0.7 */
#define SOFTENED_MOST 5u  /* 0.17: tolerates an inertia parameter five times too large */

void reaction_init(struct reactions *r)
{
    *r = (struct reactions){.stopping = false};
    for (uint32_t cause = 0; cause < FAULT_COUNT; cause++) {
        r->choice[cause] = fault_class((enum fault)cause)->initial;
    }
}

static bool can_stop(const struct axis *a)
{
    return a->state == AXIS_OPERATION_ENABLED || a->state == AXIS_QUICK_STOP;
}

/* If the drive cannot carry on: the gentlest other reaction of the class that does not rely on the encoder. */
static enum reaction choice_now(struct axis *a, enum fault cause)
{
    const enum reaction choice = (enum reaction)a->reactions.choice[cause];
    if (choice != REACTION_CARRY || a->failover.pending != FAULT_NONE || failover_begin(a, cause)) {
        return choice;
    }
    return ((fault_class(cause)->allowed >> REACTION_STOP) & 1u) != 0u ? REACTION_STOP : REACTION_OFF;
}

static int32_t softened(int32_t gain)
{
    return q15_max((int32_t)(((int64_t)gain * SOFTENED_Q8) >> 8), 1);
}

/*
 * The likely cause of a limit cycle is an inertia parameter that is too large: reduces every gain in proportion to it. The
 * memory's gain twice: the loop as a whole becomes slower but keeps its damping. False if that has not helped so far.
 */
static bool soften(struct axis *a)
{
    if (a->reactions.softened == SOFTENED_MOST) {
        return false;
    }
    a->reactions.softened++;
    a->tuning.speed_accel_q8 = softened(a->tuning.speed_accel_q8);
    a->tuning.speed_kp_q16 = softened(a->tuning.speed_kp_q16);
    a->tuning.speed_ki_q16 = softened(softened(a->tuning.speed_ki_q16));
    speed_loop_soften(&a->speed, softened(a->speed.kp_q16), softened(softened(a->speed.ki_q16)));
    return true;
}

static void react(struct axis *a, const struct fault_report *r)
{
    const enum fault cause = failover_blame(a, r->cause);
    if (cause == FAULT_LIMIT_CYCLE && soften(a)) {
        fault_warn(a, cause);
        return;
    }
    switch (choice_now(a, cause)) {
    case REACTION_CARRY:
        return; /* it does */
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

/* SPDX-License-Identifier: MIT */
#include "firmware/axis/reaction.h"

#include "drivers/fabric/gate.h"
#include "firmware/axis/axis.h"
#include "firmware/axis/rotor.h"
#include "lib/q15.h"

#define GOOD_MS 10000u

void reaction_init(struct reactions *r)
{
    *r = (struct reactions){.stopping = false};
    for (uint32_t cause = 0; cause < FAULT_COUNT; cause++) {
        r->choice[cause] = fault_class((enum fault)cause)->initial;
    }
}

bool reaction_warned(const struct reactions *r, enum fault cause)
{
    return ((r->warnings[cause / 32u] >> (cause % 32u)) & 1u) != 0u;
}

void reaction_begin(struct reactions *r)
{
    for (uint32_t n = 0; n < REACTION_WORDS; n++) {
        r->warnings[n] = 0;
    }
}

void axis_warn(struct axis *a, enum fault cause)
{
    a->reactions.warnings[cause / 32u] |= 1u << (cause % 32u);
}

static bool can_stop(const struct axis *a)
{
    return a->state == AXIS_OPERATION_ENABLED || a->state == AXIS_QUICK_STOP;
}

/* If the drive cannot carry on: the gentlest other reaction of the class that does not rely on the encoder. */
static enum reaction choice_now(struct axis *a, enum fault cause)
{
    const enum reaction choice = (enum reaction)a->reactions.choice[cause];
    if (choice != REACTION_CARRY || a->carry.waits != FAULT_NONE || carry_take_over(a, cause)) {
        return choice;
    }
    return ((fault_class(cause)->allowed >> REACTION_STOP) & 1u) != 0u ? REACTION_STOP : REACTION_OFF;
}

void axis_report(struct axis *a, enum fault seen, int32_t detail_0, int32_t detail_1)
{
    const enum fault cause = carry_blame(a, seen);
    struct reactions *const r = &a->reactions;
    const uint32_t choice = choice_now(a, cause);
    if (choice == REACTION_CARRY) {
        return; /* it does */
    }
    if (choice == REACTION_WARN) {
        axis_warn(a, cause);
    } else if (choice == REACTION_STOP && can_stop(a)) {
        r->stopping = fault_latch(a, cause, detail_0, detail_1) || r->stopping;
    } else {
        axis_raise_with(a, cause, detail_0, detail_1);
    }
}

struct outcome axis_choose_reaction(struct axis *a, enum fault cause, enum reaction choice)
{
    if (!axis_is_off(a)) {
        return outcome_of(ERROR_DRIVE_IS_ON);
    }
    if (((fault_class(cause)->allowed >> choice) & 1u) == 0u) {
        return outcome_of(ERROR_REACTION_NOT_ALLOWED);
    }
    a->reactions.choice[cause] = (uint8_t)choice;
    return OUTCOME_OK;
}

void reaction_withdraw(struct reactions *r)
{
    r->wanted = false;
    r->waiting = false;
    r->switching_on = false;
    r->resumes = false;
}

void reaction_cleared_by_hand(struct reactions *r)
{
    reaction_withdraw(r);
    r->retries = 0;
}

int32_t reaction_take_target(struct reactions *r)
{
    const int32_t rpm_q16 = r->resumes ? r->resume_rpm_q16 : 0;
    r->resumes = false;
    return rpm_q16;
}

/* Without an encoder most passing faults are a lost rotor, by whatever name; it is caught turning and need not stop. */
static void remember_target(struct axis *a)
{
    struct reactions *const r = &a->reactions;
    r->resumes = !rotor_has_encoder(a) && a->mode == AXIS_MODE_SPEED;
    r->resume_rpm_q16 = a->speed.target_rpm_q16;
}

/* Meanwhile the operator may have lowered the limit: then it is for the operator to say what now. */
static bool target_is_allowed(const struct axis *a)
{
    const struct reactions *const r = &a->reactions;
    return !r->resumes || q15_abs(r->resume_rpm_q16) <= a->params.speed_max_rpm * 65536;
}

/* Beyond the checks of `clear` and `on`. */
static bool cause_is_gone(const struct axis *a)
{
    return a->thermal.factor_q15 == Q15_ONE;
}

/*
 * A fault that may pass is latched and retries are left: it is cleared after the delay. Not in a drive that has carried on: a
 * retry would start with the encoder again.
 */
static void retry_clear(struct axis *a)
{
    struct reactions *const r = &a->reactions;
    if (!fault_class((enum fault)a->faults.cause)->retry || a->carry.cause != FAULT_NONE ||
        r->retries >= (uint32_t)a->params.retry_count) {
        return;
    }
    if (!r->waiting) {
        r->waiting = true;
        remember_target(a);
        r->latched_ms = a->time_ms;
    } else if (a->time_ms - r->latched_ms >= (uint32_t)a->params.retry_delay_ms && cause_is_gone(a) &&
               axis_clear_latches(a).error == ERROR_NONE) {
        r->waiting = false;
        r->switching_on = true;
        r->retries++;
    }
}

static void count_good_time(struct axis *a)
{
    if (a->state != AXIS_OPERATION_ENABLED) {
        a->reactions.good_since_ms = a->time_ms;
    } else if (a->time_ms - a->reactions.good_since_ms >= GOOD_MS) {
        a->reactions.retries = 0;
    }
}

void axis_retry(struct axis *a)
{
    count_good_time(a);
    if (!target_is_allowed(a)) {
        axis_withdraw(a);
    }
    if (!a->reactions.wanted) {
        return;
    }
    if (a->state == AXIS_FAULT && a->request == AXIS_REQUEST_NONE) {
        retry_clear(a);
    } else if (a->reactions.switching_on && axis_is_off(a)) {
        (void)axis_switch_on(a); /* refused, the cause is still there: the next time round */
    }
}

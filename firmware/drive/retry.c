/* SPDX-License-Identifier: MIT */
/* The thread's part of retry.h: when to clear, and when to switch on again. */
#include "firmware/drive/drive.h"
#include "firmware/source/rotor.h"
#include "lib/q15.h"

#define GOOD_MS 10000u

/* Without an encoder most passing faults are a lost rotor, by whatever name; it is caught turning and need not stop. */
static void remember_target(struct axis *a)
{
    a->retry.resumes = !rotor_has_encoder(a) && a->mode == AXIS_MODE_SPEED;
    a->retry.resume_rpm_q16 = a->speed.target_rpm_q16;
}

/* Meanwhile the operator may have lowered the limit: then it is for the operator to say what now. */
static bool target_is_allowed(const struct axis *a)
{
    return !a->retry.resumes || q15_abs(a->retry.resume_rpm_q16) <= a->params.speed_max_rpm * 65536;
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
static void clear_when_due(struct axis *a)
{
    struct retry *const r = &a->retry;
    if (!fault_class((enum fault)a->faults.cause)->retry || a->failover.cause != FAULT_NONE ||
        r->count >= (uint32_t)a->params.retry_count) {
        return;
    }
    if (!r->waiting) {
        r->waiting = true;
        remember_target(a);
        r->latched_ms = a->time_ms;
    } else if (a->time_ms - r->latched_ms >= (uint32_t)a->params.retry_delay_ms && cause_is_gone(a) &&
               drive_clear_latches(a).error == ERROR_NONE) {
        r->waiting = false;
        r->due = true;
        r->count++;
    }
}

static void count_good_time(struct axis *a)
{
    if (a->state != AXIS_OPERATION_ENABLED) {
        a->retry.good_since_ms = a->time_ms;
    } else if (a->time_ms - a->retry.good_since_ms >= GOOD_MS) {
        a->retry.count = 0;
    }
}

void drive_retry(struct axis *a)
{
    owner_follow(a);
    count_good_time(a);
    if (!target_is_allowed(a)) {
        drive_withdraw(a);
    }
    if (!a->retry.wanted) {
        return;
    }
    if (a->state == AXIS_FAULT && a->request == AXIS_REQUEST_NONE) {
        clear_when_due(a);
    } else if (a->retry.due && drive_is_off(a)) {
        (void)drive_switch_on(a); /* refused, the cause is still there: the next time round */
    }
}

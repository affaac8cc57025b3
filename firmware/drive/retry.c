/* SPDX-License-Identifier: MIT */
/* When to clear a fault, and when to switch on again. */
#include "firmware/drive/drive.h"
#include "firmware/source/rotor.h"
#include "lib/q15.h"

#define GOOD_MS 10000u

/* Without an encoder most transient faults come from a lost rotor: it is caught turning (flying start) and need not stop. */
static void remember_target(struct axis *a)
{
    a->retry.resumes = !rotor_has_encoder(a) && a->mode == AXIS_MODE_SPEED;
    a->retry.resume_rpm_q16 = a->speed.target_rpm_q16;
}

/* If speed_max_rpm has been lowered below the target meanwhile, the restart is cancelled. */
static bool target_is_allowed(const struct axis *a)
{
    return !a->retry.resumes || q15_abs(a->retry.resume_rpm_q16) <= a->params.speed_max_rpm * 65536;
}

/* In addition to the checks of `clear` and `on`. */
static bool cause_is_gone(const struct axis *a)
{
    return a->thermal.factor_q15 == Q15_ONE;
}

/*
 * Clears a latched transient fault after the delay, while retries are left. Not after a failover: a retry would start with the
 * faulty encoder again.
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
        (void)drive_switch_on(a); /* if refused, it is repeated in the next pass */
    }
}

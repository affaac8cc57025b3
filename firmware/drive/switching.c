/* SPDX-License-Identifier: MIT */
#include "firmware/drive/switching.h"

#include "firmware/drive/drive.h"
#include "firmware/drive/requests.h"
#include "firmware/settings/features.h"

static struct outcome forbidden(const struct axis *a)
{
    const struct outcome problem = drive_measured_forbids_on(a, &a->switching.tuning);
    return problem.error != ERROR_NONE ? problem : outcome_of(drive_state_forbids_on(a));
}

/* The tuning from the parameters, and whether they allow it. Padding is copied, too: no stale stack bytes in an axis. */
static struct outcome switching_tune(struct axis *a)
{
    a->switching.tuning = a->tuning;
    struct outcome problem = tuning_compute(&a->params, &a->switching.tuning);
    if (problem.error == ERROR_NONE) {
        problem = tuning_check_motor(&a->params);
    }
    return problem;
}

struct outcome drive_switch_on(struct axis *a)
{
    if (!request_settled(a)) {
        return outcome_of(ERROR_BUSY);
    }
    if (drive_state_forbids_on(a) != ERROR_NONE) {
        return outcome_of(drive_state_forbids_on(a));
    }
    a->switching.begun_ms = a->time_ms;
    struct outcome problem = switching_tune(a);
    if (problem.error == ERROR_NONE) {
        problem = forbidden(a); /* checked again at the end; this refuses early */
    }
    if (problem.error == ERROR_NONE) {
        torque_build_begin(&a->switching.builder, &a->torque, &a->params, &a->switching.tuning, a->loop.vbus_q15);
        a->switching.built = false;
        a->switching.retries = true;
        a->switching.under_way = true;
    }
    return problem;
}

/* All tables are built; checks again for faults and the bus voltage. */
static struct outcome request(struct axis *a, enum axis_request what)
{
    const uint32_t held = request_hold();
    const struct outcome problem = forbidden(a);
    if (problem.error == ERROR_NONE) {
        if (what == AXIS_REQUEST_ON) {
            retry_accept(&a->retry);
            a->retry.wanted = a->switching.retries;
        } else {
            retry_withdraw(&a->retry);
        }
        a->request = what;
    }
    request_release(held);
    return problem;
}

/* No torque is requested, so there are no tables to build. */
struct outcome drive_learn_hall(struct axis *a)
{
    if (!FEATURE_IN(HALL)) {
        return feature_absent(FEATURE_HALL);
    }
    if (!request_settled(a)) {
        return outcome_of(ERROR_BUSY);
    }
    if (drive_state_forbids_on(a) != ERROR_NONE) {
        return outcome_of(drive_state_forbids_on(a));
    }
    if (!source_has((uint32_t)a->params.angle_source, SOURCE_SWITCHES)) {
        return outcome_of(ERROR_NEEDS_HALL);
    }
    const struct outcome problem = switching_tune(a);
    return problem.error == ERROR_NONE ? request(a, AXIS_REQUEST_LEARN_HALL) : problem;
}

bool drive_prepare(struct axis *a)
{
    struct switching *const s = &a->switching;
    if (FEATURE_SOURCES > 1 && a->handover.under_way) {
        return handover_poll(a);
    }
    if (!s->under_way) {
        return false;
    }
    if (a->state != AXIS_SWITCH_ON_DISABLED || a->faults.cause != FAULT_NONE) {
        switching_end(s, ERROR_FAULT_LATCHED);
        return false;
    }
    const uint32_t elapsed_ms = a->time_ms - s->begun_ms;
    if (!s->built) {
        s->built = !torque_build_step(&s->builder, &a->torque, &a->params, &s->tuning);
        s->waits_ms = (elapsed_ms + SWITCHING_PACE_MS - 1u) / SWITCHING_PACE_MS * SWITCHING_PACE_MS;
        return true;
    }
    if (elapsed_ms < s->waits_ms) {
        return true;
    }
    s->under_way = false;
    s->outcome = s->builder.lacks_weakening ? feature_absent(FEATURE_WEAKENING) : request(a, AXIS_REQUEST_ON);
    return false;
}

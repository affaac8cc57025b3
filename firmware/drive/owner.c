/* SPDX-License-Identifier: MIT */
#include "firmware/drive/owner.h"

#include "firmware/axis/axis.h"
#include "firmware/drive/drive.h"

/* Reads the request first: once it is taken, the state already is the one that follows. */
bool owner_axis_is_off(const struct axis *a)
{
    return a->request == AXIS_REQUEST_NONE && !a->switching.under_way && !a->retry.due &&
           a->state == AXIS_SWITCH_ON_DISABLED;
}

struct outcome owner_allows(const struct axis *a, enum owner who)
{
    const uint32_t owner = a->owner.who;
    if (owner == OWNER_NONE || owner == (uint32_t)who || (a->state == AXIS_FAULT && !a->retry.waiting) ||
        owner_axis_is_off(a)) {
        return OUTCOME_OK;
    }
    return (struct outcome){ERROR_COMMANDED, (int32_t)owner};
}

void owner_take(struct axis *a, enum owner who)
{
    if (a->owner.who != (uint32_t)who) {
        retry_withdraw(&a->retry);
    }
    a->owner = (struct ownership){.who = (uint32_t)who};
    a->command_ms = a->time_ms;
}

void owner_take_over(struct axis *a, enum owner who)
{
    a->switching.retries = a->switching.retries && a->owner.who == (uint32_t)who;
    owner_take(a, who);
}

void owner_stopped(struct axis *a, enum owner who)
{
    if (a->owner.who != OWNER_NONE && a->owner.who != (uint32_t)who) {
        a->owner.stopped_by = (uint32_t)who;
    }
}

void owner_give_up(struct axis *a)
{
    drive_withdraw(a);
    a->owner.who = OWNER_NONE;
}

void owner_leave(struct axis *a, enum owner who)
{
    if (a->owner.who == (uint32_t)who) {
        owner_give_up(a);
    }
}

void owner_message(struct axis *a, enum owner who)
{
    if (a->owner.who == OWNER_NONE || a->owner.who == (uint32_t)who) {
        a->command_ms = a->time_ms;
    }
}

bool owner_is_lost(const struct axis *a)
{
    return a->master_lost != 0u || supervision_is_silent(a);
}

void owner_follow(struct axis *a)
{
    if (owner_axis_is_off(a)) {
        a->owner.who = OWNER_NONE;
    } else if (!drive_is_on(a) && a->owner.who != OWNER_NONE && owner_is_lost(a)) {
        owner_give_up(a);
    }
}

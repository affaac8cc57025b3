/* SPDX-License-Identifier: MIT */
/*
 * The only place that enables the gates. A latched fault locks the bridge out until it is cleared: even if the fault comes in
 * between the slow loop's test and store, the gates are not enabled with a latched fault. The one exception is a fault whose
 * reaction is a controlled stop (drive/reaction.h): the gates stay enabled.
 */
#ifndef FIRMWARE_CONTROL_BRIDGE_H
#define FIRMWARE_CONTROL_BRIDGE_H

#include "firmware/control/current_loop.h"

/* Enables the gates. While locked out it returns false and leaves them off. Slow loop. */
bool bridge_enable(const volatile struct current_loop *c, struct fabric *f);

/* From now on the gates are not enabled again; does not disable them. Any context. */
static inline void bridge_lock_out(volatile struct current_loop *c)
{
    c->locked_out = 1u;
}

/* The fault is cleared. Slow loop. */
static inline void bridge_unlock(volatile struct current_loop *c)
{
    c->locked_out = 0u;
}

#endif

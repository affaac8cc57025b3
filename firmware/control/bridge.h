/* SPDX-License-Identifier: MIT */
/*
 * The only place that enables the gates. A latched fault locks the bridge out until it is cleared: whatever interrupts the
 * slow loop between its own look and its store, a fault and live gates exclude each other. The one exception is a fault whose
 * reaction is a controlled stop (drive/reaction.h): its gates were live already.
 */
#ifndef FIRMWARE_CONTROL_BRIDGE_H
#define FIRMWARE_CONTROL_BRIDGE_H

#include "firmware/control/current_loop.h"

/* Lets the gates follow the PWM. While locked out it returns false and leaves them shut. Slow loop. */
bool bridge_enable(const volatile struct current_loop *c, struct fabric *f);

/* From now on the gates are not enabled again; does not shut them. Any context. */
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

/* SPDX-License-Identifier: MIT */
/*
 * Who commands an axis: the interface that enabled it, until it is off or that interface is lost. Only the owner sets targets,
 * modes and halt, and the drive restarts by itself only for its owner. All interfaces may read and stop it, and may take over
 * explicitly. Thread.
 */
#ifndef FIRMWARE_DRIVE_OWNER_H
#define FIRMWARE_DRIVE_OWNER_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/settings/error.h"

struct axis;

/* The same numbers as on the bus. */
enum owner { OWNER_NONE, OWNER_CONSOLE, OWNER_MODBUS, OWNER_CAN, OWNERS };

struct ownership {
    uint32_t who;        /* enum owner */
    uint32_t stopped_by; /* who stopped another owner's operation; OWNER_NONE: nobody */
};

/* Off, and nothing in progress will switch it on. */
bool owner_axis_is_off(const struct axis *a);

/* Whether `who` may command; ERROR_COMMANDED names the owner. */
struct outcome owner_allows(const struct axis *a, enum owner who);

/* `who` becomes the owner: its enable was accepted. */
void owner_take(struct axis *a, enum owner who);

/* `who` takes over operation, or a start in preparation; without automatic restart. */
void owner_take_over(struct axis *a, enum owner who);

/* `who` has switched it off, stopped it, or cleared its fault; recorded if it is not the owner. */
void owner_stopped(struct axis *a, enum owner who);

/* No owner from here on, and no automatic restart. */
void owner_give_up(struct axis *a);

/* The interface of `who` has been reconfigured: whoever commanded there is no longer the owner. */
void owner_leave(struct axis *a, enum owner who);

/* A message was received: restarts the command time-out, if it is from the owner or there is none. */
void owner_message(struct axis *a, enum owner who);

/* The owner has sent nothing for command_timeout_ms, or its bus reports it as lost. Any context. */
bool owner_is_lost(const struct axis *a);

/* Clears the owner when the axis is off, or when it is lost while the bridge is off: then no automatic restart. */
void owner_follow(struct axis *a);

#endif

/* SPDX-License-Identifier: MIT */
/*
 * Who commands an axis: the line whose enabling was accepted, until it is off, or that line is lost. Only the owner sets
 * targets, modes and halts, and only for the owner does the drive start again by itself. Everybody reads, everybody may stop,
 * and may take over, but has to say so. Thread.
 */
#ifndef FIRMWARE_DRIVE_OWNER_H
#define FIRMWARE_DRIVE_OWNER_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/settings/error.h"

struct axis;

/* The numbers are those on the bus. */
enum owner { OWNER_NONE, OWNER_CONSOLE, OWNER_MODBUS, OWNER_CAN, OWNERS };

struct ownership {
    uint32_t who;        /* enum owner */
    uint32_t stopped_by; /* who ended what another one commanded; OWNER_NONE: it has ended otherwise */
};

/* Off, and nothing is under way that will switch it on. */
bool owner_axis_rests(const struct axis *a);

/* Whether `who` may command; ERROR_COMMANDED says who does. A fault that is not tried again refuses by itself. */
struct outcome owner_allows(const struct axis *a, enum owner who);

/* `who` commands from here on: his enabling was accepted. */
void owner_take(struct axis *a, enum owner who);

/* He takes over what goes on, a start that is prepared, too; he has not asked for a restart. */
void owner_take_over(struct axis *a, enum owner who);

/* `who` has switched it off, stops it, or forgets its fault. The owner, or another one, who is then named. */
void owner_stopped(struct axis *a, enum owner who);

/* Nobody commands any more, and nothing starts by itself. */
void owner_give_up(struct axis *a);

/* The line of `who` is another one from here on: who commanded there does so no more. */
void owner_leave(struct axis *a, enum owner who);

/* A sign of life; only the owner's counts where there is one. */
void owner_message(struct axis *a, enum owner who);

/* The owner is silent for longer than command_timeout_ms, or its bus says that it is gone. Any context. */
bool owner_is_lost(const struct axis *a);

/* Lets go of who has nothing left to command, and of who is lost while nothing turns: then nothing starts again. */
void owner_follow(struct axis *a);

#endif

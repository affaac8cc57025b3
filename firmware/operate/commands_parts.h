/* SPDX-License-Identifier: MIT */
/*
 * The commands: each carries out a line whose words have been counted, words[0] is its name, and answers in s->out. The table
 * of names is in commands.c. Thread.
 */
#ifndef FIRMWARE_OPERATE_COMMANDS_PARTS_H
#define FIRMWARE_OPERATE_COMMANDS_PARTS_H

#include <stddef.h>

#include "firmware/operate/session.h"

/* A row of the table: rows of the same name are adjacent and differ in their number of words. */
struct command {
    const char *name;
    const char *arguments; /* capitals: a value or a name of that kind; lower case: that word, or one of several */
    const char *help;
    size_t words; /* of the whole line */
    void (*run)(struct session *s, char *const *words);
};

extern const struct command command_table[];
extern const size_t command_count;

/* ---- commands_power.c: on and off, faults cleared, the motor identified ---- */

void run_on(struct session *s, char *const *words);
void run_off(struct session *s, char *const *words);
void run_quick_stop(struct session *s, char *const *words);
void run_clear(struct session *s, char *const *words);
void run_identify(struct session *s, char *const *words);
void run_identify_what(struct session *s, char *const *words);

/* ---- commands_motion.c: set-points of all modes, homing, learning ---- */

void run_speed(struct session *s, char *const *words);
void run_torque(struct session *s, char *const *words);
void run_position(struct session *s, char *const *words);
void run_position_by(struct session *s, char *const *words);
void run_cyclic_position(struct session *s, char *const *words);
void run_cyclic_speed(struct session *s, char *const *words);
void run_cyclic_torque(struct session *s, char *const *words);
void run_home(struct session *s, char *const *words);
void run_learn(struct session *s, char *const *words);
void run_zero(struct session *s, char *const *words);
void run_angle(struct session *s, char *const *words);

/* ---- commands_status.c: the present state, and that at a fault ---- */

void run_status(struct session *s, char *const *words);
void run_fault(struct session *s, char *const *words);

/* ---- commands_keeping.c: what survives power-off ---- */

void run_save(struct session *s, char *const *words);
void run_load(struct session *s, char *const *words);
void run_defaults(struct session *s, char *const *words);

/* ---- commands_settings.c: parameters, and reactions to faults ---- */

void run_get(struct session *s, char *const *words);
void run_set(struct session *s, char *const *words);
void run_reactions(struct session *s, char *const *words);
void run_reaction(struct session *s, char *const *words);

/* ---- commands_scope.c: what is watched, captures, the stream ---- */

void run_scope(struct session *s, char *const *words);
void run_scope_do(struct session *s, char *const *words);
void run_scope_set(struct session *s, char *const *words);
void run_scope_trigger(struct session *s, char *const *words);
void run_stream(struct session *s, char *const *words);

#endif

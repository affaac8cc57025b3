/* SPDX-License-Identifier: MIT */
/*
 * The one table of texts, for every interface of the drive. Any context: constant strings.
 *
 * Texts of parameters, errors, and faults' hints and details are compressed by the build (firmware/tables/messages_packed.py):
 * each character from MESSAGE_PAIR on stands for two, which may stand for pairs in turn. text_put_char() expands them.
 */
#ifndef FIRMWARE_OPERATE_MESSAGES_H
#define FIRMWARE_OPERATE_MESSAGES_H

#include "firmware/drive/drive.h"
#include "firmware/settings/features.h"

#define MESSAGE_PAIR    0x80u
#define MESSAGE_WAITING 3u /* second characters that can be waiting while the first are written */

/* The pairs, from MESSAGE_PAIR on. */
extern const char message_pairs[];

/* Description of a parameter, by its row in param_table. */
const char *message_of_param(uint32_t row);

const char *message_of_error(enum error error);

/* As `make FEATURES` spells it. */
const char *message_of_feature(enum feature feature);

const char *message_of_state(enum axis_state state);

/* What a start is doing: enum start_phase. */
const char *message_of_phase(uint32_t phase);

/* enum owner. */
const char *message_of_owner(uint32_t owner);

const char *message_of_mode(enum axis_mode mode);

/* Name, e.g. "over-current (hardware)", and a hint what to check. */
const char *message_of_fault(enum fault cause);
const char *message_fault_hint(enum fault cause);

/* What fault_record.detail means, "" if nothing: '@' stands for the first value, '#' for the second. */
const char *message_fault_detail(enum fault cause);

/* A character of a name as typed at the console: '_' for a blank, lower case. */
char message_typed(char c);

const char *message_of_reaction(enum reaction reaction);

/* When a new voltage takes effect. */
const char *message_of_update(enum pwm_update update);

#endif

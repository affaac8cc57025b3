/* SPDX-License-Identifier: MIT */
/*
 * The one table of texts, for every interface of the drive. Any context: constant strings.
 *
 * What a parameter, an error, and a fault's hint and detail say is packed by the build (firmware/tables/messages_packed.py):
 * each character from MESSAGE_PAIR on stands for two, which may be such ones again. text_put_char() writes what they stand for.
 */
#ifndef FIRMWARE_OPERATE_MESSAGES_H
#define FIRMWARE_OPERATE_MESSAGES_H

#include "firmware/drive/drive.h"
#include "firmware/settings/features.h"

#define MESSAGE_PAIR    0x80u
#define MESSAGE_WAITING 3u /* second characters at most, while the first are written */

/* The two of each character, from MESSAGE_PAIR to the last. */
extern const char message_pairs[];

/* What a parameter is, by its row in param_table. */
const char *message_of_param(uint32_t row);

const char *message_of_error(enum error error);

/* As `make FEATURES` spells it. */
const char *message_of_feature(enum feature feature);

const char *message_of_state(enum axis_state state);

/* What a start is doing: enum start_phase. */
const char *message_of_phase(uint32_t phase);

/* Who commands. */
const char *message_of_owner(uint32_t owner);

const char *message_of_mode(enum axis_mode mode);

/* Fixed names, e.g. "over-current (hardware)", and a hint what to check. */
const char *message_of_fault(enum fault cause);
const char *message_fault_hint(enum fault cause);

/* What fault_record.detail means, "" if nothing: '@' stands for the first value, '#' for the second. */
const char *message_fault_detail(enum fault cause);

/* A character of a name as typed: '_' for a blank, and lower case. */
char message_typed(char c);

const char *message_of_reaction(enum reaction reaction);

/* When voltages act. */
const char *message_of_update(enum pwm_update update);

#endif

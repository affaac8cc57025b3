/* SPDX-License-Identifier: MIT */
/* Why a request was refused, shared by all parts of the firmware: every interface reports the same. */
#ifndef FIRMWARE_SETTINGS_ERROR_H
#define FIRMWARE_SETTINGS_ERROR_H

#include <stdint.h>

#include "firmware/settings/errors.h"

#define ERROR_NUMBER(number, name, text) ERROR_##name = (number),

enum error { ERROR_NONE, ERRORS(ERROR_NUMBER) ERROR_COUNT };

/* `value` completes messages with a number: the limit, or what would work, in the text's unit. */
struct outcome {
    enum error error;
    int32_t value;
};

static inline struct outcome outcome_of(enum error error)
{
    return (struct outcome){error, 0};
}

#define OUTCOME_OK outcome_of(ERROR_NONE)

#endif

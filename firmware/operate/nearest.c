/* SPDX-License-Identifier: MIT */
/* Which of some names somebody may have meant. */
#include "firmware/operate/commands.h"
#include "firmware/operate/messages.h"

#define NAME_MOST 40u
#define FAR       1000u

static uint32_t least(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

/* Levenshtein's: characters to add, remove or replace, whatever their case. */
static uint32_t edits(const char *word, const char *name, size_t length)
{
    uint8_t row[NAME_MOST + 1u];
    for (uint32_t n = 0; n <= length; n++) {
        row[n] = (uint8_t)n;
    }
    for (uint32_t typed = 1; *word != '\0'; word++, typed++) {
        uint32_t corner = typed - 1u;
        row[0] = (uint8_t)typed;
        for (uint32_t n = 1; n <= length; n++) {
            const uint32_t same = message_typed(*word) == message_typed(name[n - 1u]) ? 0u : 1u;
            const uint32_t best = least(corner + same, least(row[n], row[n - 1u]) + 1u);
            corner = row[n];
            row[n] = (uint8_t)best;
        }
    }
    return row[length];
}

/* One, if the name begins with the word. */
static uint32_t distance(const char *word, size_t typed, const char *name)
{
    const size_t length = text_length(name);
    if (length == 0u || length > NAME_MOST || typed > NAME_MOST) {
        return FAR;
    }
    return typed > 1u && typed < length && edits(word, name, typed) == 0u ? 1u : edits(word, name, length);
}

const char *nearest_name(const char *word, names_fn name_of)
{
    const size_t typed = text_length(word);
    const char *best = NULL;
    uint32_t closest = (uint32_t)typed / 3u + 1u; /* from here on it is another word */
    const char *name;
    for (uint32_t n = 0; typed > 1u && (name = name_of(n)) != NULL; n++) {
        const uint32_t far = distance(word, typed, name);
        if (far < closest || (best == NULL && far == closest && far < 2u)) {
            closest = far;
            best = name;
        }
    }
    return best;
}

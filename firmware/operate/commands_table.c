/* SPDX-License-Identifier: MIT */
#include "firmware/operate/commands.h"

/* clang-format off */
/* commands.c carries them out. */
const struct command commands_help[] = {
    {"help", "", "this list", .run = NULL},
    {"help", " TOPIC", "what a command, parameter, fault or the number of a refusal is", {ARGUMENT_TOPIC}, .run = NULL},
};
/* clang-format on */

#define GROUP(rows) \
    { \
        rows, sizeof rows / sizeof rows[0] \
    }
#define GROUP_OF(name, rows) \
    { \
        FEATURE_IN(name) ? rows : NULL, FEATURE_IN(name) ? sizeof rows / sizeof rows[0] : 0u \
    }

/* clang-format off */
static const struct command_group {
    const struct command *rows;
    size_t count;
} groups[] = {
    GROUP(commands_help), GROUP(commands_drive), GROUP_OF(IDENTIFY, commands_identify), GROUP(commands_motion),
    GROUP_OF(POSITION, commands_position), GROUP(commands_cyclic), GROUP_OF(LEARN, commands_learn),
    GROUP_OF(POSITION, commands_zero), GROUP(commands_fault), GROUP(commands_angle), GROUP(commands_params),
    GROUP_OF(SETTINGS, commands_settings), GROUP(commands_defaults), GROUP(commands_reaction), GROUP(commands_machine),
    GROUP_OF(SCOPE, commands_scope), GROUP_OF(SCOPE, commands_sweep), GROUP(commands_version),
#if AXIS_COUNT > 1u
    GROUP(commands_axis),
#endif
};
/* clang-format on */

/* Commands that a build without the feature refuses by its name. */
static const struct {
    const char *name;
    enum feature feature;
} commands_of_features[] = {
    {"identify", FEATURE_IDENTIFY}, {"pp", FEATURE_POSITION},  {"hm", FEATURE_POSITION},   {"csp", FEATURE_POSITION},
    {"zero", FEATURE_POSITION},     {"learn", FEATURE_LEARN},  {"save", FEATURE_SETTINGS}, {"load", FEATURE_SETTINGS},
    {"scope", FEATURE_SCOPE},       {"stream", FEATURE_SCOPE}, {"sweep", FEATURE_SCOPE},
};

enum feature commands_absent(const char *name)
{
    for (size_t n = 0; n < sizeof commands_of_features / sizeof commands_of_features[0]; n++) {
        if (text_equal(name, commands_of_features[n].name)) {
            return commands_of_features[n].feature;
        }
    }
    return FEATURE_COUNT;
}

/* The nth row; past the end NULL, and *n is reduced by the number of rows. */
static const struct command *row_or_rest(uint32_t *n)
{
    for (size_t group = 0; group < sizeof groups / sizeof groups[0]; group++) {
        if (*n < groups[group].count) {
            return &groups[group].rows[*n];
        }
        *n -= groups[group].count;
    }
    return NULL;
}

const struct command *commands_row(uint32_t n)
{
    return row_or_rest(&n);
}

const char *commands_name(uint32_t n)
{
    const struct command *const row = commands_row(n);
    if (row == NULL) {
        return NULL;
    }
    return n > 0u && text_equal(row->name, commands_row(n - 1u)->name) ? "" : row->name;
}

const char *help_topic(uint32_t n)
{
    const char *const command = commands_name(n);
    if (command != NULL) {
        return command;
    }
    (void)row_or_rest(&n);
    return n < param_count ? param_table[n].name : NULL;
}

size_t command_words(const struct command *command)
{
    size_t words = 1;
    while (words <= ARGUMENTS_MAX && command->kinds[words - 1u] != ARGUMENT_NONE) {
        words++;
    }
    return words;
}

const struct command *commands_find(const char *name, size_t words)
{
    const struct command *found = NULL;
    for (size_t group = 0; group < sizeof groups / sizeof groups[0]; group++) {
        const struct command *const end = groups[group].rows + groups[group].count;
        for (const struct command *row = groups[group].rows; row != end; row++) {
            if (text_equal(name, row->name) && (found == NULL || command_words(row) == words)) {
                found = row;
            }
        }
    }
    return found;
}

static bool is_letter(char c)
{
    return c >= 'a' && c <= 'z';
}

/* One of the words of "trigger SIGNAL above|below". */
static bool has_word(const char *text, const char *word)
{
    for (; *text != '\0'; text++) {
        size_t same = 0;
        while (word[same] != '\0' && text[same] == word[same]) {
            same++;
        }
        if (same > 0u && word[same] == '\0' && !is_letter(text[same])) {
            return true;
        }
        while (is_letter(*text) && is_letter(text[1])) {
            text++;
        }
    }
    return false;
}

const struct command *commands_with(const char *name, const char *word)
{
    const struct command *row;
    for (uint32_t n = 0; (row = commands_row(n)) != NULL; n++) {
        if (text_equal(row->name, name) && has_word(row->arguments, word)) {
            return row;
        }
    }
    return NULL;
}

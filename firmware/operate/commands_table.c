/* SPDX-License-Identifier: MIT */
#include "firmware/operate/commands.h"

/* clang-format off */
/* commands.c answers them: they are about this table. */
const struct command commands_help[] = {
    {"help", "", "this list", .run = NULL},
    {"help", " COMMAND", "what it takes and does", {ARGUMENT_COMMAND}, .run = NULL},
};
/* clang-format on */

#define GROUP(rows) \
    { \
        rows, sizeof rows / sizeof rows[0] \
    }

static const struct command_group {
    const struct command *rows;
    size_t count;
} groups[] = {
    GROUP(commands_help),     GROUP(commands_drive),  GROUP(commands_identify), GROUP(commands_motion),
    GROUP(commands_position), GROUP(commands_cyclic), GROUP(commands_learn),    GROUP(commands_zero),
    GROUP(commands_fault),    GROUP(commands_angle),  GROUP(commands_settings), GROUP(commands_reaction),
    GROUP(commands_machine),  GROUP(commands_scope),  GROUP(commands_version),
};

const struct command *commands_row(uint32_t n)
{
    for (size_t group = 0; group < sizeof groups / sizeof groups[0]; group++) {
        if (n < groups[group].count) {
            return &groups[group].rows[n];
        }
        n -= groups[group].count;
    }
    return NULL;
}

size_t command_words(const struct command *command)
{
    size_t words = 1;
    while (words <= ARGUMENTS_MOST && command->kinds[words - 1u] != ARGUMENT_NONE) {
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

/* SPDX-License-Identifier: MIT */
#include "firmware/operate/commands.h"

#define UNKNOWN_COMMAND "unknown command; 'help' lists them"

/* All rows of a name, or of all. */
static bool put_help(struct session *s, const char *name)
{
    const struct command *row;
    bool found = false;
    for (uint32_t n = 0; (row = commands_row(n)) != NULL; n++) {
        if (name == NULL || text_equal(name, row->name)) {
            text_print(&s->out, "%s%s: %s\n", row->name, row->arguments, row->help);
            found = true;
        }
    }
    return found;
}

static void help(struct session *s, const char *name)
{
    if (!put_help(s, name)) {
        answer_about(s, name, UNKNOWN_COMMAND);
    }
}

/* ---- a line ---- */

/* Splits the line at blanks; returns the number of words, one more than fit if there are too many. */
static size_t split_line(char *line, char **words)
{
    size_t count = 0;
    for (;;) {
        while (*line == ' ') {
            *line++ = '\0';
        }
        if (*line == '\0') {
            return count;
        }
        if (count > ARGUMENTS_MOST) {
            return count + 1u;
        }
        words[count++] = line;
        while (*line != ' ' && *line != '\0') {
            line++;
        }
    }
}

static void run_row(struct session *s, const struct command *command, const struct arguments *a)
{
    if (command->request != NULL) {
        answer(s, command->request(s->axis));
    } else if (command->demand != NULL) {
        answer(s, command->demand(s->axis, a->value[1]));
    } else if (command->run != NULL) {
        command->run(s, a);
    } else {
        help(s, command->kinds[0] == ARGUMENT_COMMAND ? a->word[1] : NULL);
    }
}

void commands_execute(struct session *s, char *line)
{
    struct arguments a;
    const size_t count = split_line(line, a.word);
    if (count == 0u) {
        return;
    }
    const struct command *const command = commands_find(a.word[0], count);
    if (command == NULL && commands_absent(a.word[0]) != FEATURE_COUNT) {
        answer(s, feature_absent(commands_absent(a.word[0])));
    } else if (command == NULL) {
        answer_about(s, a.word[0], UNKNOWN_COMMAND);
    } else if (count != command_words(command)) {
        text_print(&s->out, "error: usage: %s%s\n", command->name, command->arguments);
    } else if (arguments_read(s, command, &a)) {
        run_row(s, command, &a);
    }
}

/* SPDX-License-Identifier: MIT */
#include "firmware/operate/commands.h"

#include "firmware/operate/messages.h"
#include "firmware/settings/config.h"

#define UNKNOWN_COMMAND "unknown command; 'help' lists them"

/* ---- the tables ---- */

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

/* ---- answers ---- */

void answer_about(struct session *s, const char *word, const char *what)
{
    text_print(&s->out, "error: %s: %s\n", word, what);
}

void answer_filled(struct text *out, const char *text, int32_t first, int32_t second)
{
    for (; *text != '\0'; text++) {
        if (*text == '@' || *text == '#') {
            text_print(out, "%d", *text == '@' ? first : second);
        } else {
            text_put_char(out, *text);
        }
    }
    text_put(out, "\n");
}

void answer(struct session *s, struct outcome outcome)
{
    text_put(&s->out, outcome.error != ERROR_NONE ? "error: " : "");
    answer_filled(&s->out, message_of_error(outcome.error), outcome.value, 0);
}

/* ---- commands about commands ---- */

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

static void run_help(struct session *s, const struct arguments *a)
{
    (void)a;
    (void)put_help(s, NULL);
}

static void run_help_about(struct session *s, const struct arguments *a)
{
    if (!put_help(s, a->word[1])) {
        answer_about(s, a->word[1], UNKNOWN_COMMAND);
    }
}

/* clang-format off */
const struct command commands_help[] = {
    {"help", "", "this list", .run = run_help},
    {"help", " COMMAND", "what it takes and does", {ARGUMENT_COMMAND}, .run = run_help_about},
};
/* clang-format on */

/* The answer already uses the mode of the next line. */
static void run_machine(struct session *s, const struct arguments *a)
{
    s->machine = a->value[1] == 0;
    answer(s, OUTCOME_OK);
}

/* clang-format off */
const struct command commands_machine[] = {
    {"machine", " on|off", "no echo, no prompt; a line with '.' behind each answer, for programs",
     {ARGUMENT_CHOICE}, .run = run_machine},
};
/* clang-format on */

static void run_version(struct session *s, const struct arguments *a)
{
    (void)a;
    text_put(&s->out, "mssfoc " CONFIG_VERSION "\n");
}

/* clang-format off */
const struct command commands_version[] = {
    {"version", "", "of this firmware", .run = run_version},
};
/* clang-format on */

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

/* The row of that name and number of words, or the first of that name; NULL if there is none. */
static const struct command *find_row(const char *name, size_t words)
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

static void run_row(struct session *s, const struct command *command, const struct arguments *a)
{
    if (command->request != NULL) {
        answer(s, command->request(s->axis));
    } else if (command->demand != NULL) {
        answer(s, command->demand(s->axis, a->value[1]));
    } else {
        command->run(s, a);
    }
}

void commands_execute(struct session *s, char *line)
{
    struct arguments a;
    const size_t count = split_line(line, a.word);
    if (count == 0u) {
        return;
    }
    const struct command *const command = find_row(a.word[0], count);
    if (command == NULL) {
        answer_about(s, a.word[0], UNKNOWN_COMMAND);
    } else if (count != command_words(command)) {
        text_print(&s->out, "error: usage: %s%s\n", command->name, command->arguments);
    } else if (arguments_read(s, command, &a)) {
        run_row(s, command, &a);
    }
}

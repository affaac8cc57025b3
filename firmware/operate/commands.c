/* SPDX-License-Identifier: MIT */
#include "firmware/operate/commands.h"

#include "firmware/operate/messages.h"

#define UNKNOWN_COMMAND "unknown command; 'help' lists them"

/* ---- help ---- */

static bool put_param_help(struct session *s, const char *name)
{
    const struct param_info *const info = param_find(name);
    if (info != NULL) {
        const char *const unit = param_unit(info);
        text_print(&s->out, "%s: %s\n%d...%d%s%s, initially %d\n", name,
                   message_of_param((uint32_t)(info - param_table)), info->min, info->max, *unit != '\0' ? " " : "",
                   unit, info->initial);
    }
    return info != NULL;
}

static bool put_fault_help(struct session *s, const char *name)
{
    const enum fault fault = fault_typed(name);
    if (fault != FAULT_COUNT) {
        text_print(&s->out, "fault %u, %s: look at: %s\n", (uint32_t)fault, message_of_fault(fault),
                   message_fault_hint(fault));
    }
    return fault != FAULT_COUNT;
}

/* A bus has only the number of a refusal; its value is in another register. */
static bool put_refusal_help(struct session *s, const char *word)
{
    int32_t number;
    const bool known = text_parse_int(word, &number) && number > 0 && number < ERROR_COUNT;
    if (known) {
        text_print(&s->out, "refusal %d: ", number);
        answer_template(&s->out, message_of_error((enum error)number));
    }
    return known;
}

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
    bool found = put_help(s, name);
    found = (name != NULL && (put_param_help(s, name) | put_fault_help(s, name) | put_refusal_help(s, name))) || found;
    if (!found) {
        answer_unknown(s, name, "no command, parameter or fault; 'help' and 'get all' list them", help_topic);
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
        if (count > ARGUMENTS_MAX) {
            return count + 1u;
        }
        words[count++] = line;
        while (*line != ' ' && *line != '\0') {
            line++;
        }
    }
}

/* The scope is attached to the chosen axis; "axis 2 LINE" may name another. */
static bool is_elsewhere(const struct session *s, const struct command *command, const struct arguments *a)
{
    const bool lists = command_words(command) > 1u && text_equal(a->word[1], "list");
    return !lists && AXIS_COUNT > 1u && FEATURE_IN(SCOPE) && commands_absent(command->name) == FEATURE_SCOPE &&
           s->scope->axis != s->axis;
}

static void run_row(struct session *s, const struct command *command, const struct arguments *a)
{
    const bool owner_only = command->begins != PROGRESS_NONE || command->demand != NULL || command->owner_only;
    const struct outcome allowed = owner_only ? owner_allows(s->axis, OWNER_CONSOLE) : OUTCOME_OK;
    s->accepted = false;
    if (is_elsewhere(s, command, a)) {
        answer(s, outcome_of(ERROR_SCOPE_ELSEWHERE));
    } else if (allowed.error != ERROR_NONE) {
        answer(s, allowed);
    } else if (command->request != NULL) {
        answer(s, command->request(s->axis));
    } else if (command->demand != NULL) {
        answer(s, command->demand(s->axis, a->value[1]));
    } else if (command->run != NULL) {
        command->run(s, a);
    } else {
        help(s, command->kinds[0] == ARGUMENT_TOPIC ? a->word[1] : NULL);
    }
    if (s->accepted && owner_only &&
        owner_allows(s->axis, OWNER_CONSOLE).error == ERROR_NONE) { /* unless taken over since */
        owner_take(s->axis, OWNER_CONSOLE);
    } else if (command->request == drive_clear_fault || /* even if refused: it has ended a retry */
               (s->accepted && command->request != NULL && command->request != drive_forget)) {
        owner_stopped(s->axis, OWNER_CONSOLE);
    }
    if (s->accepted && (command->begins != PROGRESS_NONE || command->run == NULL)) { /* replaces what was in progress */
        s->progress[session_axis(s)] = command->begins;
    }
}

/* By the row that has the second word. */
static void refuse_count(struct session *s, const struct command *command, const struct arguments *a, size_t count)
{
    const struct command *const meant = count > 1u ? commands_with(command->name, a->word[1]) : NULL;
    text_print(&s->out, "error: usage: %s%s\n", command->name, (meant != NULL ? meant : command)->arguments);
}

static void execute_line(struct session *s, char *line)
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
        answer_unknown(s, a.word[0], UNKNOWN_COMMAND, commands_name);
    } else if (count != command_words(command)) {
        refuse_count(s, command, &a, count);
    } else if (arguments_read(s, command, &a)) {
        run_row(s, command, &a);
    }
}

void commands_execute(struct session *s, char *line)
{
    struct axis *const chosen = s->axis;
    char *const rest = axis_of_line(s, line);
    if (rest != NULL) {
        execute_line(s, rest);
    }
    s->axis = rest == line ? s->axis : chosen;
}

/* SPDX-License-Identifier: MIT */
/* Which of several motors a line of the console is for. */
#include "firmware/operate/commands.h"

static const char *word_behind(const char *at)
{
    while (*at != ' ' && *at != '\0') {
        at++;
    }
    while (*at == ' ') {
        at++;
    }
    return at;
}

static bool is_word(const char *at, const char *word)
{
    while (*word != '\0' && *at == *word) {
        at++;
        word++;
    }
    return *word == '\0' && (*at == ' ' || *at == '\0');
}

static bool there_is(struct session *s, int32_t number)
{
    if (number < 1 || number > (int32_t)AXIS_COUNT) {
        answer(s, (struct outcome){ERROR_AXIS_RANGE, (int32_t)AXIS_COUNT});
        return false;
    }
    return true;
}

char *axis_of_line(struct session *s, char *line)
{
    char *begin = line;
    while (*begin == ' ') {
        begin++;
    }
    char *const number = begin + (word_behind(begin) - begin);
    char *const rest = number + (word_behind(number) - number);
    if (AXIS_COUNT == 1u || !is_word(begin, "axis") || *rest == '\0' || is_word(rest, "axis")) {
        return line;
    }
    char *end = number;
    while (*end != ' ') {
        end++;
    }
    *end = '\0';
    int32_t value = 0;
    (void)text_parse_int(number, &value);
    if (!there_is(s, value)) {
        return NULL;
    }
    s->axis = &s->axes[value - 1];
    return rest;
}

/* The scope goes with it. */
static void run_axis(struct session *s, const struct arguments *a)
{
    if (!there_is(s, a->value[1])) {
        return;
    }
    struct axis *const chosen = &s->axes[a->value[1] - 1];
    const enum error error = FEATURE_IN(SCOPE) && s->scope != NULL ? scope_attach(s->scope, chosen) : ERROR_NONE;
    s->axis = error == ERROR_NONE ? chosen : s->axis;
    answer(s, outcome_of(error));
}

/* clang-format off */
const struct command commands_axis[] = {
    {"axis", " NUMBER", "the motor that the lines behind it are for; 'axis 2 LINE': this one LINE alone", {ARGUMENT_WHOLE},
     .run = run_axis},
};
/* clang-format on */

void put_axis(struct text *out, uint32_t axis)
{
    if (AXIS_COUNT > 1u) {
        text_print(out, "axis %u: ", axis + 1u);
    }
}

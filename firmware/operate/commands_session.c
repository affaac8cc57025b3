/* SPDX-License-Identifier: MIT */
/* Which of several motors a line is for, who reads the answers, and what this firmware is. */
#include "firmware/operate/commands.h"
#include "firmware/operate/messages.h"
#include "firmware/settings/config.h"

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
    {"axis", " NUMBER", "the motor that the following lines are for; 'axis 2 LINE': only this LINE", {ARGUMENT_WHOLE},
     .run = run_axis},
};
/* clang-format on */

void put_axis(struct text *out, uint32_t axis)
{
    if (AXIS_COUNT > 1u) {
        text_print(out, "axis %u: ", axis + 1u);
    }
}

/* ---- machine, version ---- */

/* By the Makefile (.ci/commit), of constant length so that no address depends on it. */
#ifndef CONFIG_COMMIT
#define CONFIG_COMMIT "unknown"
#endif

/* This answer already uses the new mode. */
static void run_machine(struct session *s, const struct arguments *a)
{
    s->machine = a->value[1] == 0;
    answer(s, OUTCOME_OK);
}

/* clang-format off */
const struct command commands_machine[] = {
    {"machine", " on|off", "no echo, no prompt; a line with '.' after each answer, for programs",
     {ARGUMENT_CHOICE}, .run = run_machine},
};
/* clang-format on */

/* One line: version, commit and build choices. */
static void run_version(struct session *s, const struct arguments *a)
{
    (void)a;
    text_put(&s->out, "mssfoc " CONFIG_VERSION ", commit " CONFIG_COMMIT);
    text_print(&s->out, ", PWM %u Hz, dead time %u ns", (uint32_t)CONFIG_PWM_HZ, (uint32_t)CONFIG_DEAD_TIME_NS);
    const char *before = ", without ";
    for (uint32_t n = 0; n < FEATURE_COUNT; n++) {
        if (!FEATURE_IS_IN(n)) {
            text_print(&s->out, "%s%s", before, message_of_feature((enum feature)n));
            before = ", ";
        }
    }
    text_put(&s->out, FEATURES_LEFT_OUT == 0u ? ", all features\n" : "\n");
}

/* clang-format off */
const struct command commands_version[] = {
    {"version", "", "of this firmware: its commit, and what was chosen when it was built", .run = run_version},
};
/* clang-format on */

/* SPDX-License-Identifier: MIT */
#include "firmware/operate/commands.h"

#include <stddef.h>

#include "firmware/operate/messages.h"
#include "firmware/operate/postmortem_text.h"
#include "firmware/operate/text.h"
#include "firmware/settings/config.h"
#include "firmware/system/measure.h"

#define WORDS_MAX 3u

struct command {
    const char *name;
    const char *arguments;
    const char *help;
    size_t words; /* of the whole line */
    void (*run)(struct axis *a, char *const *words);
};

static void error_about(const char *word, const char *what)
{
    text_put("error: ");
    text_put(word);
    text_put(": ");
    text_put_line(what);
}

/* A line in which '@' stands for the value. */
static void put_completed(const char *text, int32_t value)
{
    for (const char *s = text; *s != '\0'; s++) {
        if (*s == '@') {
            text_put_int(value);
        } else {
            text_put_char(*s);
        }
    }
    text_put_line("");
}

static void answer(struct outcome outcome)
{
    if (outcome.error != ERROR_NONE) {
        text_put("error: ");
    }
    put_completed(message_of_error(outcome.error), outcome.value);
}

/* "name: 1.234 unit" */
static void put_milli(const char *name, int32_t q15, int32_t range_milli, const char *unit)
{
    text_put(name);
    text_put_milli(tuning_milli_from_q15(q15, range_milli));
    text_put(unit);
}

static void put_rpm(const char *name, int32_t rpm_q4)
{
    text_put(name);
    text_put_milli((int32_t)((int64_t)rpm_q4 * 1000 / 16));
    text_put(" rpm");
}

static void put_heat(const struct axis *a)
{
    text_put(", winding: ");
    text_put_int(a->thermal.winding_q4 / 16);
    text_put(" degC");
    if (a->thermal.factor_q15 < Q15_ONE) {
        text_put(", current limit held to ");
        text_put_int(a->thermal.factor_q15 * 100 / Q15_ONE);
        text_put(" %");
    }
    text_put_line("");
}

static void put_warnings(const struct axis *a)
{
    for (uint32_t cause = 0; cause < FAULT_COUNT; cause++) {
        if (reaction_warned(&a->reactions, (enum fault)cause)) {
            text_put("warning: ");
            text_put_line(message_of_fault((enum fault)cause));
        }
    }
}

static void run_status(struct axis *a, char *const *words)
{
    (void)words;
    const struct current_loop *const c = &a->loop;
    text_put("state: ");
    text_put_line(message_of_state(a->state));
    text_put("fault: ");
    text_put_line(message_of_fault(a->faults.cause));
    put_rpm("speed: ", a->speed.speed_rpm_q4);
    put_rpm(", reference ", a->speed.speed_ref_rpm_q4);
    text_put_line("");
    put_milli("current: d ", c->i_d_q15, a->params.i_range_ma, " A");
    put_milli(", q ", c->i_q_q15, a->params.i_range_ma, " A");
    put_milli(", reference d ", c->i_d_ref_q15, a->params.i_range_ma, " A");
    put_milli(", q ", c->i_q_ref_q15, a->params.i_range_ma, " A");
    text_put_line("");
    put_milli("bus: ", c->vbus_q15, a->params.v_range_mv, " V");
    put_heat(a);
    put_warnings(a);
    text_put("current loop: ");
    text_put_int((int32_t)measure_current_loop_cycles(&a->time_ms));
    text_put_line(" cycles");
    text_put("up: ");
    text_put_milli((int32_t)a->time_ms);
    text_put_line(" s");
}

static void run_on(struct axis *a, char *const *words)
{
    (void)words;
    answer(axis_switch_on(a));
}

static void run_off(struct axis *a, char *const *words)
{
    (void)words;
    answer(axis_switch_off(a));
}

static void run_quick_stop(struct axis *a, char *const *words)
{
    (void)words;
    answer(axis_quick_stop(a));
}

static void run_speed(struct axis *a, char *const *words)
{
    int32_t rpm;
    if (!text_parse_int(words[1], &rpm)) {
        error_about(words[1], "not a whole number of rpm");
        return;
    }
    answer(axis_command_speed(a, rpm));
}

static void run_torque(struct axis *a, char *const *words)
{
    int32_t milliamp;
    if (!text_parse_milli(words[1], &milliamp)) {
        error_about(words[1], "not a current in amperes, like 1.5");
        return;
    }
    answer(axis_command_current(a, milliamp));
}

static void put_detail(const struct axis *a)
{
    const char *const text = message_fault_detail(a->faults.cause);
    if (*text != '\0') {
        text_put("found: ");
        put_completed(text, a->faults.detail[0]);
    }
}

static void run_fault(struct axis *a, char *const *words)
{
    (void)words;
    postmortem_print();
    text_put("fault: ");
    text_put_line(message_of_fault(a->faults.cause));
    if (a->faults.cause == FAULT_NONE) {
        return;
    }
    const struct fault_snapshot *const s = &a->faults.snapshot;
    put_detail(a);
    text_put("look at: ");
    text_put_line(message_fault_hint(a->faults.cause));
    text_put("at: ");
    text_put_milli((int32_t)s->time_ms);
    text_put(" s, state ");
    text_put_line(message_of_state(s->state));
    put_milli("phase currents: a ", s->i_a_q15, a->params.i_range_ma, " A");
    put_milli(", b ", s->i_b_q15, a->params.i_range_ma, " A");
    put_milli(", c ", s->i_c_q15, a->params.i_range_ma, " A");
    put_milli("; d ", s->i_d_q15, a->params.i_range_ma, " A");
    put_milli(", q ", s->i_q_q15, a->params.i_range_ma, " A");
    text_put_line("");
    put_milli("bus: ", s->vbus_q15, a->params.v_range_mv, " V");
    put_rpm(", speed: ", s->speed_rpm_q4);
    text_put(", angle: ");
    text_put_int((int32_t)(s->angle_u16 * 3600u / 65536u) / 10);
    text_put(" deg, gate status: ");
    text_put_hex(s->gate_status);
    text_put_line("");
}

static void run_clear(struct axis *a, char *const *words)
{
    (void)words;
    answer(axis_clear_fault(a));
}

static void put_param(const struct params *p, const struct param_info *info)
{
    text_put(info->name);
    text_put(" = ");
    text_put_int(param_get(p, info));
    text_put("  (");
    text_put_int(info->min);
    text_put("...");
    text_put_int(info->max);
    text_put_line(")");
}

static void run_get(struct axis *a, char *const *words)
{
    if (text_equal(words[1], "all")) {
        for (size_t i = 0; i < param_count; i++) {
            put_param(&a->params, &param_table[i]);
        }
        return;
    }
    const struct param_info *const info = param_find(words[1]);
    if (info == NULL) {
        error_about(words[1], "no such parameter; 'get all' lists them");
        return;
    }
    put_param(&a->params, info);
}

static void run_set(struct axis *a, char *const *words)
{
    const struct param_info *const info = param_find(words[1]);
    int32_t value;
    if (info == NULL) {
        error_about(words[1], "no such parameter; 'get all' lists them");
    } else if (!text_parse_int(words[2], &value)) {
        error_about(words[2], "not a whole number");
    } else if (value < info->min || value > info->max) {
        text_put("error: ");
        text_put(info->name);
        text_put(" must be ");
        text_put_int(info->min);
        text_put("...");
        text_put_int(info->max);
        text_put_line("");
    } else if (!axis_is_off(a)) {
        answer(outcome_of(ERROR_DRIVE_IS_ON));
    } else {
        param_set(&a->params, info, value);
        text_put_line("ok");
    }
}

/* A fault that leaves a choice: which, and which it has. */
static void put_reaction(const struct axis *a, enum fault cause)
{
    text_put(message_of_fault(cause));
    text_put(": ");
    text_put(message_of_reaction(a->reactions.choice[cause]));
    text_put("  (");
    const char *before = "";
    for (uint32_t choice = 0; choice < REACTION_COUNT; choice++) {
        if (((fault_class(cause)->allowed >> choice) & 1u) != 0u) {
            text_put(before);
            text_put(message_of_reaction((enum reaction)choice));
            before = ", ";
        }
    }
    text_put_line(")");
}

static void run_reactions(struct axis *a, char *const *words)
{
    (void)words;
    for (uint32_t cause = FAULT_NONE + 1u; cause < FAULT_COUNT; cause++) {
        if (fault_class((enum fault)cause)->allowed != 1u << REACTION_OFF) {
            put_reaction(a, (enum fault)cause);
        }
    }
}

static void run_reaction(struct axis *a, char *const *words)
{
    const enum fault cause = message_find_fault(words[1]);
    uint32_t choice = 0;
    while (choice < REACTION_COUNT && !text_equal(words[2], message_of_reaction((enum reaction)choice))) {
        choice++;
    }
    if (cause == FAULT_COUNT) {
        error_about(words[1], "no such fault; 'reaction' lists those with a choice, '_' stands for a blank");
    } else if (choice == REACTION_COUNT) {
        error_about(words[2], "not one of off, stop, warn");
    } else {
        answer(axis_choose_reaction(a, cause, (enum reaction)choice));
    }
}

static void run_version(struct axis *a, char *const *words)
{
    (void)a;
    (void)words;
    text_put_line("mssfoc " CONFIG_VERSION);
}

static void run_help(struct axis *a, char *const *words);

static const struct command commands[] = {
    {"help", "", "this list", 1, run_help},
    {"status", "", "state, speed, currents, bus voltage", 1, run_status},
    {"on", "", "calibrate, align if needed, enable operation", 1, run_on},
    {"off", "", "bridge off at once, the motor coasts", 1, run_off},
    {"quickstop", "", "brake to standstill, then off", 1, run_quick_stop},
    {"speed", " RPM", "speed control to RPM", 2, run_speed},
    {"torque", " A", "current control, q axis, peak amperes", 2, run_torque},
    {"fault", "", "first cause and the drive's values at that instant", 1, run_fault},
    {"clear", "", "forget the fault if its cause is gone", 1, run_clear},
    {"get", " PARAM", "a parameter and its range, or 'all'", 2, run_get},
    {"set", " PARAM VALUE", "change a parameter while off", 3, run_set},
    {"reaction", "", "what follows from each fault that leaves a choice", 1, run_reactions},
    {"reaction", " FAULT off|stop|warn", "choose it, while off", 3, run_reaction},
    {"version", "", "of this firmware", 1, run_version},
};

static void run_help(struct axis *a, char *const *words)
{
    (void)a;
    (void)words;
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        text_put(commands[i].name);
        text_put(commands[i].arguments);
        text_put(": ");
        text_put_line(commands[i].help);
    }
}

/* Cuts the line at its blanks; returns the number of words, WORDS_MAX + 1 when there are more than fit. */
static size_t split(char *line, char **words)
{
    size_t count = 0;
    while (*line != '\0') {
        while (*line == ' ') {
            *line++ = '\0';
        }
        if (*line == '\0') {
            break;
        }
        if (count == WORDS_MAX) {
            return WORDS_MAX + 1u;
        }
        words[count++] = line;
        while (*line != ' ' && *line != '\0') {
            line++;
        }
    }
    return count;
}

/* The row of that name, and of those that share it the one that takes so many words; NULL when there is none. */
static const struct command *find(const char *name, size_t words)
{
    const struct command *found = NULL;
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        if (text_equal(name, commands[i].name) && (found == NULL || commands[i].words == words)) {
            found = &commands[i];
        }
    }
    return found;
}

void commands_execute(struct axis *a, char *line)
{
    char *words[WORDS_MAX];
    const size_t count = split(line, words);
    if (count == 0u) {
        return;
    }
    const struct command *const command = find(words[0], count);
    if (command == NULL) {
        error_about(words[0], "unknown command; 'help' lists them");
    } else if (count != command->words) {
        text_put("error: usage: ");
        text_put(command->name);
        text_put_line(command->arguments);
    } else {
        command->run(a, words);
    }
}

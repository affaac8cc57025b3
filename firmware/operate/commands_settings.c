/* SPDX-License-Identifier: MIT */
#include <stddef.h>

#include "firmware/operate/answers.h"
#include "firmware/operate/commands_parts.h"
#include "firmware/operate/messages.h"
#include "firmware/operate/units.h"

/* After a number: a blank and its unit, if any. */
static void put_unit(struct session *s, const struct param_info *info)
{
    const char *const unit = unit_of(info);
    text_put(&s->out, *unit != '\0' ? " " : "");
    text_put(&s->out, unit);
}

static void put_range(struct session *s, const struct param_info *info)
{
    text_put_int(&s->out, info->min);
    text_put(&s->out, "...");
    text_put_int(&s->out, info->max);
}

/* Those that differ from their initial values, each followed by its initial value. */
static void put_changed(struct session *s)
{
    const struct params *const p = &s->axis->params;
    for (size_t i = 0; i < param_count; i++) {
        const struct param_info *const info = &param_table[i];
        if (param_get(p, info) != info->initial) {
            text_put(&s->out, info->name);
            text_put(&s->out, " = ");
            text_put_int(&s->out, param_get(p, info));
            put_unit(s, info);
            text_put(&s->out, "  (initially ");
            text_put_int(&s->out, info->initial);
            text_put_line(&s->out, ")");
        }
    }
}

static void put_param(struct session *s, const struct params *p, const struct param_info *info)
{
    text_put(&s->out, info->name);
    text_put(&s->out, " = ");
    text_put_int(&s->out, param_get(p, info));
    put_unit(s, info);
    text_put(&s->out, "  (");
    put_range(s, info);
    text_put_line(&s->out, ")");
}

void run_get(struct session *s, char *const *words)
{
    if (text_equal(words[1], "all")) {
        for (size_t i = 0; i < param_count; i++) {
            put_param(s, &s->axis->params, &param_table[i]);
        }
        return;
    }
    if (text_equal(words[1], "--changed")) {
        put_changed(s);
        return;
    }
    const struct param_info *const info = param_find(words[1]);
    if (info == NULL) {
        answer_about(s, words[1], "no such parameter; 'get all' lists them");
        return;
    }
    put_param(s, &s->axis->params, info);
}

void run_set(struct session *s, char *const *words)
{
    const struct param_info *const info = param_find(words[1]);
    int32_t value;
    if (info == NULL) {
        answer_about(s, words[1], "no such parameter; 'get all' lists them");
    } else if (!text_parse_int(words[2], &value)) {
        answer_about(s, words[2], "not a whole number");
    } else if (value < info->min || value > info->max) {
        text_put(&s->out, "error: ");
        text_put(&s->out, info->name);
        text_put(&s->out, " must be ");
        put_range(s, info);
        put_unit(s, info);
        text_put_line(&s->out, "");
    } else if (!drive_is_off(s->axis)) {
        answer(s, outcome_of(ERROR_DRIVE_IS_ON));
    } else {
        param_set(&s->axis->params, info, value);
        text_put_line(&s->out, "ok");
    }
}

/* For a fault that leaves a choice: the present choice, and the options. */
static void put_reaction(struct session *s, enum fault cause)
{
    text_put(&s->out, message_of_fault(cause));
    text_put(&s->out, ": ");
    text_put(&s->out, message_of_reaction(s->axis->reactions.choice[cause]));
    text_put(&s->out, "  (");
    const char *before = "";
    for (uint32_t choice = 0; choice < REACTION_COUNT; choice++) {
        if (((fault_class(cause)->allowed >> choice) & 1u) != 0u) {
            text_put(&s->out, before);
            text_put(&s->out, message_of_reaction((enum reaction)choice));
            before = ", ";
        }
    }
    text_put_line(&s->out, ")");
}

void run_reactions(struct session *s, char *const *words)
{
    (void)words;
    for (uint32_t cause = FAULT_NONE + 1u; cause < FAULT_COUNT; cause++) {
        if (fault_class((enum fault)cause)->allowed != 1u << REACTION_OFF) {
            put_reaction(s, (enum fault)cause);
        }
    }
}

void run_reaction(struct session *s, char *const *words)
{
    const enum fault cause = message_find_fault(words[1]);
    uint32_t choice = 0;
    while (choice < REACTION_COUNT && !text_equal(words[2], message_of_reaction((enum reaction)choice))) {
        choice++;
    }
    if (cause == FAULT_COUNT) {
        answer_about(s, words[1], "no such fault; 'reaction' lists those with a choice, '_' stands for a blank");
    } else if (choice == REACTION_COUNT) {
        answer_about(s, words[2], "not one of off, stop, warn, carry");
    } else {
        answer(s, drive_choose_reaction(s->axis, cause, (enum reaction)choice));
    }
}

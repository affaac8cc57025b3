/* SPDX-License-Identifier: MIT */
#include "firmware/operate/answers.h"
#include "firmware/operate/commands_parts.h"

/* A whole number, or a line that says `what` the word is not. */
static bool parse_whole(struct session *s, const char *word, int32_t *value, const char *what)
{
    const bool whole = text_parse_int(word, value);
    if (!whole) {
        answer_about(s, word, what);
    }
    return whole;
}

static bool parse_rpm(struct session *s, const char *word, int32_t *rpm)
{
    return parse_whole(s, word, rpm, "not a whole number of rpm");
}

static bool parse_counts(struct session *s, const char *word, int32_t *counts)
{
    return parse_whole(s, word, counts, "not a whole number of counts");
}

static bool parse_current(struct session *s, const char *word, int32_t *milliamp)
{
    const bool current = text_parse_milli(word, milliamp);
    if (!current) {
        answer_about(s, word, "not a current in amperes, like 1.5");
    }
    return current;
}

void run_speed(struct session *s, char *const *words)
{
    int32_t rpm;
    if (parse_rpm(s, words[1], &rpm)) {
        answer(s, drive_command_speed(s->axis, rpm));
    }
}

void run_torque(struct session *s, char *const *words)
{
    int32_t milliamp;
    if (parse_current(s, words[1], &milliamp)) {
        answer(s, drive_command_current(s->axis, milliamp));
    }
}

void run_position(struct session *s, char *const *words)
{
    int32_t counts;
    if (parse_counts(s, words[1], &counts)) {
        answer(s, drive_command_position(s->axis, counts, false));
    }
}

void run_position_by(struct session *s, char *const *words)
{
    int32_t counts;
    if (!text_equal(words[1], "by")) {
        answer_about(s, words[1], "not 'by'");
    } else if (parse_counts(s, words[2], &counts)) {
        answer(s, drive_command_position(s->axis, counts, true));
    }
}

void run_cyclic_position(struct session *s, char *const *words)
{
    int32_t counts;
    if (parse_counts(s, words[1], &counts)) {
        answer(s, drive_command_cyclic_position(s->axis, counts));
    }
}

void run_cyclic_speed(struct session *s, char *const *words)
{
    int32_t rpm;
    if (parse_rpm(s, words[1], &rpm)) {
        answer(s, drive_command_cyclic_speed(s->axis, rpm));
    }
}

void run_cyclic_torque(struct session *s, char *const *words)
{
    int32_t milliamp;
    if (parse_current(s, words[1], &milliamp)) {
        answer(s, drive_command_cyclic_current(s->axis, milliamp));
    }
}

void run_home(struct session *s, char *const *words)
{
    if (text_equal(words[1], "index")) {
        answer(s, drive_command_home(s->axis, HOMING_INDEX));
    } else if (text_equal(words[1], "block")) {
        answer(s, drive_command_home(s->axis, HOMING_BLOCK));
    } else {
        answer_about(s, words[1], "not one of index, block");
    }
}

void run_learn(struct session *s, char *const *words)
{
    if (text_equal(words[1], "cogging")) {
        answer(s, drive_learn_cogging(s->axis));
    } else if (text_equal(words[1], "hall")) {
        answer(s, drive_learn_hall(s->axis));
    } else {
        answer_about(s, words[1], "not one of cogging, hall");
    }
}

/* To the end, with the bus served in between. */
static struct outcome change_source(struct session *s, uint32_t target)
{
    const struct outcome outcome = drive_change_source(s->axis, target);
    if (outcome.error != ERROR_NONE) {
        return outcome;
    }
    while (s->axis->handover.under_way && drive_prepare(s->axis)) {
        text_serve_bus(&s->out);
        idle_serve_watchdog(s->out.idle);
    }
    return s->axis->handover.outcome;
}

void run_angle(struct session *s, char *const *words)
{
    static const char *const sources[] = {
        [PARAM_ANGLE_ENCODER] = "encoder", [PARAM_ANGLE_SENSORLESS] = "observer", [PARAM_ANGLE_HALL] = "hall"};
    uint32_t source = 0;
    while (source <= PARAM_ANGLE_HALL && !text_equal(words[1], sources[source])) {
        source++;
    }
    if (source > PARAM_ANGLE_HALL) {
        answer_about(s, words[1], "not one of encoder, observer, hall");
    } else {
        answer(s, change_source(s, source));
    }
}

void run_zero(struct session *s, char *const *words)
{
    (void)words;
    answer(s, drive_set_zero(s->axis));
}

/* SPDX-License-Identifier: MIT */
#include <stddef.h>

#include "firmware/operate/answers.h"
#include "firmware/operate/commands_parts.h"
#include "firmware/operate/scope_text.h"
#include "firmware/operate/signal_text.h"
#include "firmware/operate/stream.h"

#define BAUD_LEAST 9600
#define BAUD_MOST  3000000

void run_scope(struct session *s, char *const *words)
{
    (void)words;
    scope_text_settings(s);
}

void run_scope_do(struct session *s, char *const *words)
{
    if (text_equal(words[1], "list")) {
        scope_text_signals(s);
    } else if (text_equal(words[1], "arm")) {
        answer(s, scope_arm(s->scope));
    } else if (text_equal(words[1], "fire")) {
        answer(s, outcome_of(scope_fire(s->scope)));
    } else if (text_equal(words[1], "off")) {
        scope_off(s->scope);
        answer(s, OUTCOME_OK);
    } else if (text_equal(words[1], "read")) {
        scope_text_samples(s, SCOPE_CAPTURE);
    } else if (text_equal(words[1], "fault")) {
        scope_text_samples(s, SCOPE_FAULT);
    } else {
        answer_about(s, words[1], "not one of list, arm, fire, off, read, fault");
    }
}

/* "i_q,speed": false after reporting what is wrong. */
static bool parse_choice(struct session *s, char *names, struct signal_choice *choice)
{
    for (char *name = names; name != NULL;) {
        size_t length = 0;
        while (name[length] != ',' && name[length] != '\0') {
            length++;
        }
        const bool last = name[length] == '\0';
        const size_t found = signal_find(name, length);
        name[length] = '\0';
        if (found == signal_count) {
            answer_about(s, name, "no such signal; 'scope list' has them, separate them by commas only");
            return false;
        }
        if (choice->count == SIGNALS_MOST) {
            answer_about(s, name, "is one too many; 8 signals at most");
            return false;
        }
        choice->which[choice->count++] = (uint8_t)found;
        name = last ? NULL : name + length + 1;
    }
    return true;
}

static void set_signals(struct session *s, char *names)
{
    struct signal_choice choice = {0};
    if (parse_choice(s, names, &choice)) {
        answer(s, outcome_of(scope_choose(s->scope, &choice)));
    }
}

/* False after reporting what is wrong. */
static bool parse_within(struct session *s, const char *word, uint32_t least, uint32_t most, uint32_t *value)
{
    int32_t number;
    if (!text_parse_int(word, &number)) {
        answer_about(s, word, "not a whole number");
        return false;
    }
    if (number < (int32_t)least || number > (int32_t)most) {
        answer_filled(s, "error: must be @...#", (int32_t)least, (int32_t)most);
        return false;
    }
    *value = (uint32_t)number;
    return true;
}

void run_scope_set(struct session *s, char *const *words)
{
    uint32_t value;
    if (text_equal(words[1], "signals")) {
        set_signals(s, words[2]);
    } else if (text_equal(words[1], "every")) {
        if (parse_within(s, words[2], 1u, SCOPE_EVERY_MOST, &value)) {
            answer(s, outcome_of(scope_set_every(s->scope, value)));
        }
    } else if (text_equal(words[1], "before")) {
        if (parse_within(s, words[2], 0u, scope_capacity(s->scope) - 1u, &value)) {
            answer(s, outcome_of(scope_set_before(s->scope, value)));
        }
    } else if (text_equal(words[1], "trigger") && text_equal(words[2], scope_word_of_when(CAPTURE_NEVER))) {
        answer(s, outcome_of(scope_set_trigger(s->scope, s->scope->trigger_on, CAPTURE_NEVER, 0)));
    } else {
        answer_about(s, words[1], "not one of signals A,B,..., every TICKS, before SAMPLES, trigger never");
    }
}

void run_scope_trigger(struct session *s, char *const *words)
{
    size_t length = 0;
    while (words[2][length] != '\0') {
        length++;
    }
    const size_t signal = signal_find(words[2], length);
    const enum capture_when when = scope_find_when(words[3]);
    int32_t milli;
    if (!text_equal(words[1], "trigger")) {
        answer_about(s, words[1], "not trigger");
    } else if (signal == signal_count) {
        answer_about(s, words[2], "no such signal; 'scope list' has them");
    } else if (when == CAPTURE_NEVER) {
        answer_about(s, words[3], "not one of above, below, rises, falls");
    } else if (!text_parse_milli(words[4], &milli)) {
        answer_about(s, words[4], "not a number with at most three decimals");
    } else {
        const struct signal_scale scale = signal_scale(signal_table[signal].format, s->axis);
        answer(s, outcome_of(scope_set_trigger(s->scope, (uint32_t)signal, when, signal_raw(scale, milli))));
    }
}

/* The answer goes out at the old rate; "0" ends the stream, whatever rate follows it. */
void run_stream(struct session *s, char *const *words)
{
    int32_t every_ms;
    int32_t baud;
    if (!text_parse_int(words[1], &every_ms) || every_ms < 0 || every_ms > STREAM_EVERY_MOST) {
        answer_about(s, words[1], "not 1...1000 ms, or 0 to end it");
    } else if (!text_parse_int(words[2], &baud) || baud < BAUD_LEAST || baud > BAUD_MOST) {
        answer_about(s, words[2], "not 9600...3000000 baud");
    } else if (every_ms == 0) {
        answer(s, OUTCOME_OK);
        stream_end(&s->stream);
    } else {
        answer(s, OUTCOME_OK);
        stream_begin(&s->stream, s->scope, (uint32_t)every_ms, (uint32_t)baud);
    }
}

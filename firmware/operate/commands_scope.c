/* SPDX-License-Identifier: MIT */
#include <stddef.h>

#include "firmware/operate/answers.h"
#include "firmware/operate/commands_parts.h"
#include "firmware/operate/messages.h"
#include "firmware/operate/signal_text.h"
#include "firmware/operate/stream.h"

#define BAUD_LEAST 9600
#define BAUD_MOST  3000000

static const char *const whens[] = {[CAPTURE_NEVER] = "never",
                                    [CAPTURE_ABOVE] = "above",
                                    [CAPTURE_BELOW] = "below",
                                    [CAPTURE_RISES] = "rises",
                                    [CAPTURE_FALLS] = "falls"};

static void put_number(struct session *s, const char *name, uint32_t value)
{
    text_put(&s->out, name);
    text_put_int(&s->out, (int32_t)value);
}

static void put_names(struct session *s, const struct signal_choice *choice, char between)
{
    for (uint32_t i = 0; i < choice->count; i++) {
        if (i > 0u) {
            text_put_char(&s->out, between);
        }
        text_put(&s->out, signal_table[choice->which[i]].name);
    }
}

/* "23571/32768": a value in thousandths of its unit is raw times this. */
static void put_scale(struct session *s, const struct signal_info *info)
{
    const struct signal_scale scale = signal_scale(info->format, s->axis);
    text_put_int(&s->out, scale.milli);
    text_put_char(&s->out, '/');
    text_put_int(&s->out, (int32_t)scale.per);
}

static void put_signal(struct session *s, const struct signal_info *info)
{
    text_put(&s->out, info->name);
    text_put_char(&s->out, ' ');
    text_put(&s->out, signal_unit(info->format));
    text_put_char(&s->out, ' ');
    put_scale(s, info);
    text_put(&s->out, ": ");
    text_put_line(&s->out, signal_text(info->name));
}

static void put_trigger(struct session *s)
{
    const struct capture *const c = &s->scope->capture;
    const struct signal_info *const info = &signal_table[s->scope->trigger_on];
    text_put(&s->out, "trigger: ");
    if (c->when != CAPTURE_NEVER) {
        text_put(&s->out, info->name);
        text_put_char(&s->out, ' ');
    }
    text_put(&s->out, whens[c->when]);
    if (c->when != CAPTURE_NEVER) {
        text_put_char(&s->out, ' ');
        text_put_milli(&s->out, signal_milli(signal_scale(info->format, s->axis), c->level));
        text_put_char(&s->out, ' ');
        text_put(&s->out, signal_unit(info->format));
    }
    put_number(s, ", before: ", c->before);
    put_number(s, " of ", scope_capacity(s->scope));
    text_put_line(&s->out, " samples");
}

static void put_capture(struct session *s)
{
    static const char *const states[] = {[CAPTURE_OFF] = "off",
                                         [CAPTURE_WAITING] = "waits for its trigger",
                                         [CAPTURE_TRIGGERED] = "triggered",
                                         [CAPTURE_DONE] = "done"};
    static const char *const causes[] = {[CAPTURE_BY_NOTHING] = "",
                                         [CAPTURE_BY_SIGNAL] = " by the signal",
                                         [CAPTURE_BY_FAULT] = " by a fault",
                                         [CAPTURE_BY_COMMAND] = " by command"};
    const struct capture *const c = &s->scope->capture;
    const uint32_t state = c->state;
    text_put(&s->out, "capture: ");
    text_put(&s->out, states[state]);
    if (state == CAPTURE_TRIGGERED || state == CAPTURE_DONE) {
        text_put(&s->out, causes[c->cause]);
    }
    put_number(s, ", dropped: ", s->scope->torn);
    put_number(s, ", late: ", s->scope->late);
    text_put_line(&s->out, "");
}

void run_scope(struct session *s, char *const *words)
{
    (void)words;
    text_put(&s->out, "signals: ");
    put_names(s, &s->scope->choice, ',');
    put_number(s, ", every: ", s->scope->every);
    text_put_line(&s->out, " samples of the current loop");
    put_trigger(s);
    put_capture(s);
    put_number(s, "kept from the last fault: ", scope_extent(s->scope, SCOPE_FAULT).samples);
    text_put_line(&s->out, " samples, one a millisecond");
}

/*
 * A heading, the names, the scales, then a line of raw values for each sample. One that is overwritten while it is read ends
 * short: its last line says how many there were.
 */
static void put_samples(struct session *s, enum scope_record record)
{
    const struct scope_extent extent = scope_extent(s->scope, record);
    if (extent.samples == 0u) {
        text_put_line(&s->out, record == SCOPE_FAULT ? "error: no fault has left samples yet"
                                                     : "error: no capture is done; 'scope' says how far it is");
        return;
    }
    put_number(s, "samples: ", extent.samples);
    put_number(s, ", trigger: ", extent.trigger);
    put_number(s, ", every: ", record == SCOPE_FAULT ? 1u : s->scope->every);
    put_number(s, ", a millisecond has: ", record == SCOPE_FAULT ? 1u : s->scope->rate_of);
    put_number(s, ", dropped: ", record == SCOPE_FAULT ? 0u : s->scope->torn);
    put_number(s, ", late: ", record == SCOPE_FAULT ? 0u : s->scope->late);
    text_put_line(&s->out, "");
    put_names(s, extent.choice, ' ');
    text_put_line(&s->out, "");
    for (uint32_t i = 0; i < extent.words; i++) {
        put_scale(s, &signal_table[extent.choice->which[i]]);
        text_put(&s->out, i + 1u < extent.words ? " " : "\r\n");
    }
    const uint32_t kept = s->scope->recorder.kept;
    uint32_t sample = 0;
    for (; sample < extent.samples && (record != SCOPE_FAULT || s->scope->recorder.kept == kept); sample++) {
        int32_t values[SIGNALS_MOST];
        (void)scope_read(s->scope, record, sample * extent.words, values, extent.words);
        for (uint32_t i = 0; i < extent.words; i++) {
            text_put_int(&s->out, values[i]);
            text_put(&s->out, i + 1u < extent.words ? " " : "\r\n");
        }
        idle_serve_watchdog(s->out.idle);
    }
    put_number(s, "end: ", sample);
    text_put_line(&s->out, "");
}

static void answer_arm(struct session *s)
{
    answer(s, scope_arm(s->scope));
}

static void answer_off(struct session *s)
{
    scope_off(s->scope);
    answer(s, OUTCOME_OK);
}

static void put_list(struct session *s)
{
    for (size_t i = 0; i < signal_count; i++) {
        put_signal(s, &signal_table[i]);
    }
}

void run_scope_do(struct session *s, char *const *words)
{
    if (text_equal(words[1], "list")) {
        put_list(s);
    } else if (text_equal(words[1], "arm")) {
        answer_arm(s);
    } else if (text_equal(words[1], "fire")) {
        answer(s, outcome_of(scope_fire(s->scope)));
    } else if (text_equal(words[1], "off")) {
        answer_off(s);
    } else if (text_equal(words[1], "read")) {
        put_samples(s, SCOPE_CAPTURE);
    } else if (text_equal(words[1], "fault")) {
        put_samples(s, SCOPE_FAULT);
    } else {
        answer_about(s, words[1], "not one of list, arm, fire, off, read, fault");
    }
}

/* "i_q,speed": false after it has said what is wrong. */
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

/* False after it has said what is wrong. */
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
    } else if (text_equal(words[1], "trigger") && text_equal(words[2], whens[CAPTURE_NEVER])) {
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
    uint32_t when = CAPTURE_ABOVE;
    while (when <= CAPTURE_FALLS && !text_equal(words[3], whens[when])) {
        when++;
    }
    int32_t milli;
    if (!text_equal(words[1], "trigger")) {
        answer_about(s, words[1], "not trigger");
    } else if (signal == signal_count) {
        answer_about(s, words[2], "no such signal; 'scope list' has them");
    } else if (when > CAPTURE_FALLS) {
        answer_about(s, words[3], "not one of above, below, rises, falls");
    } else if (!text_parse_milli(words[4], &milli)) {
        answer_about(s, words[4], "not a number with at most three decimals");
    } else {
        const struct signal_scale scale = signal_scale(signal_table[signal].format, s->axis);
        answer(s, outcome_of(scope_set_trigger(s->scope, (uint32_t)signal, (enum capture_when)when,
                                               signal_raw(scale, milli))));
    }
}

/* The answer goes out at the rate that was; "0" ends the stream, whatever rate stands behind it. */
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

/* SPDX-License-Identifier: MIT */
#include "firmware/operate/scope_text.h"

#include <stddef.h>

#include "firmware/operate/signal_text.h"

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
    text_put(&s->out, scope_word_of_when(c->when));
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
    const struct capture *const c = &s->scope->capture;
    const uint32_t state = c->state;
    text_put(&s->out, "capture: ");
    text_put(&s->out, scope_text_of_state((enum capture_state)state));
    if (state == CAPTURE_TRIGGERED || state == CAPTURE_DONE) {
        text_put(&s->out, scope_text_of_cause((enum capture_cause)c->cause));
    }
    put_number(s, ", dropped: ", s->scope->torn);
    put_number(s, ", late: ", s->scope->late);
    text_put_line(&s->out, "");
}

void scope_text_settings(struct session *s)
{
    text_put(&s->out, "signals: ");
    put_names(s, &s->scope->choice, ',');
    put_number(s, ", every: ", s->scope->every);
    text_put_line(&s->out, " samples of the current loop");
    put_trigger(s);
    put_capture(s);
    put_number(s, "kept from the last fault: ", scope_extent(s->scope, SCOPE_FAULT).samples);
    text_put_line(&s->out, " samples, one a millisecond");
}

static void put_heading(struct session *s, enum scope_record record, const struct scope_extent *extent)
{
    const bool fault = record == SCOPE_FAULT; /* those are one a millisecond, and none is missing */
    put_number(s, "samples: ", extent->samples);
    put_number(s, ", trigger: ", extent->trigger);
    put_number(s, ", every: ", fault ? 1u : s->scope->every);
    put_number(s, ", a millisecond has: ", fault ? 1u : s->scope->rate_of);
    put_number(s, ", dropped: ", fault ? 0u : s->scope->torn);
    put_number(s, ", late: ", fault ? 0u : s->scope->late);
    text_put_line(&s->out, "");
    put_names(s, extent->choice, ' ');
    text_put_line(&s->out, "");
    for (uint32_t i = 0; i < extent->words; i++) {
        put_scale(s, &signal_table[extent->choice->which[i]]);
        text_put(&s->out, i + 1u < extent->words ? " " : "\r\n");
    }
}

static void put_sample(struct session *s, enum scope_record record, uint32_t first, uint32_t words)
{
    int32_t values[SIGNALS_MOST];
    (void)scope_read(s->scope, record, first, values, words);
    for (uint32_t i = 0; i < words; i++) {
        text_put_int(&s->out, values[i]);
        text_put(&s->out, i + 1u < words ? " " : "\r\n");
    }
}

void scope_text_samples(struct session *s, enum scope_record record)
{
    const struct scope_extent extent = scope_extent(s->scope, record);
    if (extent.samples == 0u) {
        text_put_line(&s->out, record == SCOPE_FAULT ? "error: no fault has left samples yet"
                                                     : "error: no capture is done; 'scope' says how far it is");
        return;
    }
    put_heading(s, record, &extent);
    const uint32_t kept = s->scope->recorder.kept;
    uint32_t sample = 0;
    for (; sample < extent.samples && (record != SCOPE_FAULT || s->scope->recorder.kept == kept); sample++) {
        put_sample(s, record, sample * extent.words, extent.words);
        idle_serve_watchdog(s->out.idle);
    }
    put_number(s, "end: ", sample);
    text_put_line(&s->out, "");
}

void scope_text_signals(struct session *s)
{
    for (size_t i = 0; i < signal_count; i++) {
        put_signal(s, &signal_table[i]);
    }
}

/* SPDX-License-Identifier: MIT */
#include "firmware/operate/answers.h"
#include "firmware/operate/commands_parts.h"
#include "firmware/operate/identify_text.h"

/* To the end, with the bus served in between. */
static struct outcome switch_on(struct session *s)
{
    const struct outcome outcome = drive_switch_on(s->axis);
    if (outcome.error != ERROR_NONE) {
        return outcome;
    }
    while (drive_prepare(s->axis)) {
        text_serve_bus(&s->out);
        idle_serve_watchdog(s->out.idle);
    }
    return s->axis->switching.outcome;
}

void run_on(struct session *s, char *const *words)
{
    (void)words;
    const struct outcome outcome = switch_on(s);
    answer(s, outcome);
    if (outcome.error == ERROR_NONE) {
        text_put(&s->out, "phase margin of the current loop: ");
        text_put_int(&s->out, s->axis->tuning.current_margin_u16 * 360 / 65536);
        text_put_line(&s->out, " degrees");
    }
}

void run_off(struct session *s, char *const *words)
{
    (void)words;
    answer(s, drive_switch_off(s->axis));
}

void run_quick_stop(struct session *s, char *const *words)
{
    (void)words;
    answer(s, drive_quick_stop(s->axis));
}

void run_clear(struct session *s, char *const *words)
{
    (void)words;
    answer(s, drive_clear_fault(s->axis));
}

void run_identify(struct session *s, char *const *words)
{
    (void)words;
    answer(s, drive_identify(s->axis));
}

void run_identify_what(struct session *s, char *const *words)
{
    if (text_equal(words[1], "show")) {
        identify_text_show(&s->out, &s->axis->identify);
    } else if (text_equal(words[1], "use")) {
        const struct outcome outcome = drive_identify_use(s->axis);
        answer(s, outcome);
        if (outcome.error == ERROR_NONE) {
            identify_text_used(&s->out, outcome.value);
        }
    } else {
        answer_about(s, words[1], "not one of show, use");
    }
}

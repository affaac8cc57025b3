/* SPDX-License-Identifier: MIT */
#include "firmware/operate/answers.h"

#include "firmware/operate/messages.h"
#include "firmware/settings/tuning.h"

void answer_about(struct session *s, const char *word, const char *what)
{
    text_put(&s->out, "error: ");
    text_put(&s->out, word);
    text_put(&s->out, ": ");
    text_put_line(&s->out, what);
}

void answer_filled(struct session *s, const char *text, int32_t first, int32_t second)
{
    for (; *text != '\0'; text++) {
        if (*text == '@' || *text == '#') {
            text_put_int(&s->out, *text == '@' ? first : second);
        } else {
            text_put_char(&s->out, *text);
        }
    }
    text_put_line(&s->out, "");
}

void answer(struct session *s, struct outcome outcome)
{
    if (outcome.error != ERROR_NONE) {
        text_put(&s->out, "error: ");
    }
    answer_filled(s, message_of_error(outcome.error), outcome.value, 0);
}

void answer_milli(struct session *s, const char *name, int32_t q15, int32_t range_milli, const char *unit)
{
    text_put(&s->out, name);
    text_put_milli(&s->out, tuning_milli_from_q15(q15, range_milli));
    text_put(&s->out, unit);
}

void answer_rpm(struct session *s, const char *name, int32_t rpm_q4)
{
    text_put(&s->out, name);
    text_put_milli(&s->out, (int32_t)((int64_t)rpm_q4 * 1000 / 16));
    text_put(&s->out, " rpm");
}

/* SPDX-License-Identifier: MIT */
#include "firmware/operate/commands.h"
#include "firmware/operate/messages.h"

void answer_about(struct session *s, const char *word, const char *what)
{
    text_print(&s->out, "error: %s: %s\n", word, what);
}

void answer_filled(struct text *out, const char *text, int32_t first, int32_t second)
{
    for (; *text != '\0'; text++) {
        if (*text == '@' || *text == '#') {
            text_print(out, "%d", *text == '@' ? first : second);
        } else if (*text == '$') {
            text_put(out, message_of_feature((enum feature)first));
        } else {
            text_put_char(out, *text);
        }
    }
    text_put(out, "\n");
}

void answer(struct session *s, struct outcome outcome)
{
    text_put(&s->out, outcome.error != ERROR_NONE ? "error: " : "");
    answer_filled(&s->out, message_of_error(outcome.error), outcome.value, 0);
}

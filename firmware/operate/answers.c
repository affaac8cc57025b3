/* SPDX-License-Identifier: MIT */
#include "firmware/operate/commands.h"
#include "firmware/operate/messages.h"

void answer_about(struct session *s, const char *word, const char *what)
{
    text_print(&s->out, "error: %s: %s\n", word, what);
}

void answer_unknown(struct session *s, const char *word, const char *what, names_fn names)
{
    const char *meant = names != NULL ? nearest_name(word, names, &s->out) : NULL;
    text_print(&s->out, "error: %s: %s%s", word, what, meant != NULL ? "; did you mean " : "");
    for (; meant != NULL && *meant != '\0'; meant++) {
        text_put_char(&s->out, message_typed(*meant));
    }
    text_put(&s->out, meant != NULL ? "?\n" : "\n");
}

void answer_filled(struct text *out, const char *text, int32_t first, int32_t second)
{
    for (; *text != '\0'; text++) {
        if (*text == '@' || *text == '#') {
            text_print(out, "%d", *text == '@' ? first : second);
        } else if (*text == '$') {
            text_put(out, message_of_feature((enum feature)first));
        } else if (*text == '&') {
            text_put(out, message_of_owner((uint32_t)first));
        } else {
            text_put_char(out, *text);
        }
    }
    text_put(out, "\n");
}

void answer_unfilled(struct text *out, const char *text)
{
    for (; *text != '\0'; text++) {
        const char known[] = {*text, '\0'};
        text_put(out, *text == '@' || *text == '#' || *text == '$' || *text == '&' ? "..." : known);
    }
    text_put(out, "\n");
}

void answer(struct session *s, struct outcome outcome)
{
    s->accepted = outcome.error == ERROR_NONE;
    text_put(&s->out, s->accepted ? "" : "error: ");
    answer_filled(&s->out, message_of_error(outcome.error), outcome.value, 0);
}

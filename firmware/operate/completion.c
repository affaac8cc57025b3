/* SPDX-License-Identifier: MIT */
#include "firmware/operate/commands.h"
#include "firmware/operate/messages.h"

#define BELL '\a'

struct search {
    const char *typed; /* of the last word */
    size_t length;
    const char *found; /* the first matching name, */
    size_t common;     /* number of its characters common to all matches, */
    uint32_t names;    /* number of matches */
    struct text *list; /* matches are written here, if not NULL */
};

static size_t same_characters(const char *a, const char *b, size_t most)
{
    size_t same = 0;
    while (same < most && message_typed(a[same]) == message_typed(b[same])) {
        same++;
    }
    return same;
}

static void offer(struct search *s, const char *name, size_t length)
{
    if (length == 0u || length < s->length || same_characters(name, s->typed, s->length) < s->length) {
        return;
    }
    if (s->names++ == 0u) {
        s->found = name;
        s->common = length;
    }
    s->common = same_characters(name, s->found, length < s->common ? length : s->common);
    for (size_t i = 0; s->list != NULL && i < length; i++) {
        text_put_char(s->list, message_typed(name[i]));
    }
    if (s->list != NULL) {
        text_put(s->list, "  ");
    }
}

/* True if `text` begins with `word`, followed by its end or a blank. */
static bool begins_with(const char *text, const char *word)
{
    while (*word != '\0' && *text == *word) {
        text++;
        word++;
    }
    return *word == '\0' && (*text == '\0' || *text == ' ');
}

static void offer_argument(struct search *s, const struct command *row, uint32_t number)
{
    const char *name;
    size_t length;
    for (uint32_t n = 0; (name = argument_candidate(row, number, n, &length)) != NULL; n++) {
        offer(s, name, length);
    }
}

static void offer_commands(struct search *s)
{
    const char *name;
    for (uint32_t n = 0; (name = commands_name(n)) != NULL; n++) {
        offer(s, name, text_length(name));
    }
}

/* All candidates for the line's word number `word`, from 0. */
static void offer_all(struct search *s, const char *line, uint32_t word)
{
    const struct command *row;
    if (word == 0u) {
        offer_commands(s);
        return;
    }
    while (*line == ' ') {
        line++;
    }
    for (uint32_t n = 0; (row = commands_row(n)) != NULL; n++) {
        if (begins_with(line, row->name)) {
            offer_argument(s, row, word);
        }
    }
}

/* Where the last word of the line begins, and which word it is. */
static size_t last_word(const struct line *l, uint32_t *word)
{
    size_t begins = 0;
    *word = 0u;
    for (size_t i = 0; i < l->length; i++) {
        if (l->text[i] == ' ') {
            *word += i > 0u && l->text[i - 1u] != ' ' ? 1u : 0u;
            begins = i + 1u;
        }
    }
    return begins;
}

bool completion_of(struct line *l, struct text *out)
{
    uint32_t word;
    const size_t begins = last_word(l, &word);
    struct search s = {.typed = l->text + begins, .length = l->length - begins};
    if (l->cursor != l->length) {
        return false;
    }
    offer_all(&s, l->text, word);
    if (s.names == 0u) {
        text_put_char(out, BELL);
        return false;
    }
    const bool adds = s.common > s.length || s.names == 1u;
    for (size_t i = s.length; i < s.common; i++) {
        line_insert(l, message_typed(s.found[i]), out);
    }
    if (s.names == 1u) {
        line_insert(l, ' ', out);
    } else if (!adds) {
        text_put(out, "\n");
        s = (struct search){.typed = s.typed, .length = s.length, .list = out};
        offer_all(&s, l->text, word);
        text_put(out, "\n");
    }
    return !adds;
}

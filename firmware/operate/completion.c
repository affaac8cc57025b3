/* SPDX-License-Identifier: MIT */
#include "firmware/operate/completion.h"

#include "firmware/operate/commands_parts.h"
#include "firmware/operate/messages.h"
#include "firmware/settings/params.h"

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

static void offer_part(struct search *s, const char *name, size_t length)
{
    if (length < s->length || same_characters(name, s->typed, s->length) < s->length) {
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

static void offer(struct search *s, const char *name)
{
    size_t length = 0;
    while (name[length] != '\0') {
        length++;
    }
    offer_part(s, name, length);
}

/* Of an argument like "off|stop|warn". */
static void offer_words(struct search *s, const char *argument)
{
    while (*argument >= 'a' && *argument <= 'z') {
        size_t length = 0;
        while (argument[length] >= 'a' && argument[length] <= 'z') {
            length++;
        }
        offer_part(s, argument, length);
        argument += length + (argument[length] == '|' ? 1u : 0u);
    }
}

static void offer_parameters(struct search *s)
{
    for (size_t i = 0; i < param_count; i++) {
        offer(s, param_table[i].name);
    }
}

static void offer_faults(struct search *s)
{
    for (uint32_t cause = FAULT_NONE + 1u; cause < FAULT_COUNT; cause++) {
        if (fault_class((enum fault)cause)->allowed != 1u << REACTION_OFF) {
            offer(s, message_of_fault((enum fault)cause));
        }
    }
}

/* Each name once, though several rows may share it. */
static void offer_commands(struct search *s)
{
    for (size_t i = 0; i < command_count; i++) {
        if (i == 0u || !text_equal(command_table[i].name, command_table[i - 1u].name)) {
            offer(s, command_table[i].name);
        }
    }
}

/* The `number`th argument of a row of the table, from 1; NULL if it has fewer. */
static const char *argument_of(const struct command *command, uint32_t number)
{
    const char *at = command->arguments;
    while (*at != '\0') {
        if (*at++ == ' ' && --number == 0u) {
            return at;
        }
    }
    return NULL;
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

static void offer_argument(struct search *s, const char *argument)
{
    if (begins_with(argument, "PARAM")) {
        offer_parameters(s);
    } else if (begins_with(argument, "FAULT")) {
        offer_faults(s);
    } else if (begins_with(argument, "COMMAND")) {
        offer_commands(s);
    } else {
        offer_words(s, argument);
    }
}

/* All candidates for the line's word number `word`, from 0. */
static void offer_all(struct search *s, const char *line, uint32_t word)
{
    if (word == 0u) {
        offer_commands(s);
        return;
    }
    while (*line == ' ') {
        line++;
    }
    for (size_t i = 0; i < command_count; i++) {
        const char *const argument = argument_of(&command_table[i], word);
        if (argument != NULL && begins_with(line, command_table[i].name)) {
            offer_argument(s, argument);
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
        text_put_line(out, "");
        s = (struct search){.typed = s.typed, .length = s.length, .list = out};
        offer_all(&s, l->text, word);
        text_put_line(out, "");
    }
    return !adds;
}

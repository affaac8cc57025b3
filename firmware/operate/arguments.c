/* SPDX-License-Identifier: MIT */
/* The kinds of a command's arguments: how each is parsed, how it is refused, and what completion offers. */
#include "firmware/operate/commands.h"
#include "firmware/operate/messages.h"
#include "firmware/settings/params.h"

#define BAUD_MIN 9600
#define BAUD_MAX 3000000

/* ---- parsing: false if the word does not fit ---- */

static bool read_any(const char *word, int32_t *value)
{
    (void)word;
    *value = 0;
    return true;
}

static bool read_param(const char *word, int32_t *value)
{
    const struct param_info *const info = param_find(word);
    *value = info == NULL ? 0 : (int32_t)(info - param_table);
    return info != NULL;
}

static bool read_param_group(const char *word, int32_t *value)
{
    const bool all = text_equal(word, "all");
    *value = all ? PARAMS_ALL : PARAMS_CHANGED;
    return all || text_equal(word, "--changed") || read_param(word, value);
}

static bool is_named(const char *name, const char *word)
{
    while (*name != '\0' && message_typed(*name) == message_typed(*word)) {
        name++;
        word++;
    }
    return *name == *word;
}

enum fault fault_typed(const char *name)
{
    uint32_t cause = FAULT_NONE + 1u;
    while (cause < FAULT_COUNT && !is_named(message_of_fault((enum fault)cause), name)) {
        cause++;
    }
    return (enum fault)cause;
}

static bool read_fault(const char *word, int32_t *value)
{
    *value = (int32_t)fault_typed(word);
    return *value != FAULT_COUNT;
}

static bool read_signal(const char *word, int32_t *value)
{
    *value = (int32_t)signal_find(word, text_length(word));
    return (uint32_t)*value != signal_count;
}

static bool read_stream_ms(const char *word, int32_t *value)
{
    return text_parse_int(word, value) && *value >= 0 && *value <= STREAM_EVERY_MAX;
}

static bool read_baud(const char *word, int32_t *value)
{
    return text_parse_int(word, value) && *value >= BAUD_MIN && *value <= BAUD_MAX;
}

/* The nth word of a text like "off|stop|warn"; NULL past the end. */
static const char *choice_word(const char *text, uint32_t n, size_t *length)
{
    for (;;) {
        for (*length = 0; text[*length] >= 'a' && text[*length] <= 'z'; ++*length) {
        }
        if (n-- == 0u || *length == 0u) {
            return *length > 0u ? text : NULL;
        }
        text += *length + (text[*length] == '|' ? 1u : 0u);
    }
}

/* One of "off|stop|warn": its index. */
static bool read_choice(const char *text, const char *word, int32_t *value)
{
    const char *known;
    size_t length;
    for (*value = 0; (known = choice_word(text, (uint32_t)*value, &length)) != NULL; ++*value) {
        size_t same = 0;
        while (same < length && word[same] == known[same]) {
            same++;
        }
        if (same == length && word[same] == '\0') {
            return true;
        }
    }
    return false;
}

/* ---- candidates ---- */

static const char *param_name(uint32_t n)
{
    return n < param_count ? param_table[n].name : NULL;
}

static const char *signal_name(uint32_t n)
{
    return FEATURE_IN(SCOPE) && n < signal_count ? signal_table[n].name : NULL;
}

static const char *fault_name(uint32_t n)
{
    if (n >= FAULT_COUNT) {
        return NULL;
    }
    return fault_class((enum fault)n)->allowed != 1u << REACTION_OFF ? message_of_fault((enum fault)n) : "";
}

/* ---- the kinds ---- */

struct argument_kind {
    bool (*read)(const char *word, int32_t *value); /* NULL: one of the words of the row's text */
    const char *refusal;                            /* NULL: lists these words */
    names_fn candidate;                             /* NULL: these words */
};

static const struct argument_kind argument_kinds[ARGUMENT_KINDS] = {
    [ARGUMENT_BY] = {NULL, "not 'by'", NULL},
    [ARGUMENT_TRIGGER] = {NULL, "not trigger", NULL},
    [ARGUMENT_ANY] = {read_any, NULL, NULL},
    [ARGUMENT_COMMAND] = {read_any, NULL, commands_name},
    [ARGUMENT_TOPIC] = {read_any, NULL, help_topic},
    [ARGUMENT_WHOLE] = {text_parse_int, "not a whole number", NULL},
    [ARGUMENT_RPM] = {text_parse_int, "not a whole number of rpm", NULL},
    [ARGUMENT_COUNTS] = {text_parse_int, "not a whole number of counts", NULL},
    [ARGUMENT_AMPERES] = {text_parse_milli, "not a current in amperes, like 1.5", NULL},
    [ARGUMENT_DECIMAL] = {text_parse_milli, "not a number with at most three decimals", NULL},
    [ARGUMENT_PARAM] = {read_param, "no such parameter; 'get all' lists them", param_name},
    [ARGUMENT_PARAM_GROUP] = {read_param_group, "no such parameter; 'get all' lists them", param_name},
    [ARGUMENT_FAULT] = {read_fault, "no such fault; 'reaction' lists those with a choice, '_' stands for a blank",
                        fault_name},
    [ARGUMENT_SIGNAL] = {FEATURE_IN(SCOPE) ? read_signal : read_any, "no such signal; 'scope list' has them",
                         signal_name},
    [ARGUMENT_STREAM_MS] = {read_stream_ms, "not 1...1000 ms, or 0 to end it", NULL},
    [ARGUMENT_BAUD] = {read_baud, "not 9600...3000000 baud", NULL},
};

/* The text of argument `number`, from 1, up to a blank or the end; NULL if the row has fewer. */
static const char *argument_text(const struct command *row, uint32_t number)
{
    const char *at = row->arguments;
    while (*at != '\0') {
        if (*at++ == ' ' && --number == 0u) {
            return at;
        }
    }
    return NULL;
}

static const struct argument_kind *argument_kind(const struct command *row, uint32_t number)
{
    return &argument_kinds[number <= ARGUMENTS_MAX ? row->kinds[number - 1u] : ARGUMENT_NONE];
}

const char *argument_candidate(const struct command *row, uint32_t number, uint32_t n, size_t *length)
{
    const char *const text = argument_text(row, number);
    const struct argument_kind *const kind = argument_kind(row, number);
    if (text == NULL || kind->candidate == NULL) {
        return text == NULL ? NULL : choice_word(text, n, length);
    }
    const char *const name = kind->candidate(n);
    *length = name == NULL ? 0u : text_length(name);
    return name;
}

static void refuse_choice(struct session *s, const char *word, const char *text)
{
    text_print(&s->out, "error: %s: not one of ", word);
    for (; *text != '\0' && *text != ' '; text++) {
        if (*text == '|') {
            text_put(&s->out, ", ");
        } else {
            text_put_char(&s->out, *text);
        }
    }
    text_put(&s->out, "\n");
}

bool arguments_read(struct session *s, const struct command *command, struct arguments *a)
{
    for (uint32_t n = 1; n < command_words(command); n++) {
        const struct argument_kind *const kind = argument_kind(command, n);
        const char *const text = argument_text(command, n);
        const bool fits =
            kind->read == NULL ? read_choice(text, a->word[n], &a->value[n]) : kind->read(a->word[n], &a->value[n]);
        if (!fits && kind->refusal == NULL) {
            refuse_choice(s, a->word[n], text);
        } else if (!fits) {
            answer_unknown(s, a->word[n], kind->refusal, kind->candidate);
        }
        if (!fits) {
            return false;
        }
    }
    return true;
}

/* ==== completion ==== */

#define BELL '\a'

struct search {
    const char *typed; /* the last word */
    size_t length;
    const char *found; /* the first match, */
    size_t common;     /* length of its prefix common to all matches, */
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

/* All candidates for word number `word` of the line, from 0. */
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

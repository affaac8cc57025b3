/* SPDX-License-Identifier: MIT */
#include "firmware/operate/line.h"

#include "firmware/settings/params.h"

#define CTRL(letter) ((letter) - '@')
#define ESCAPE       0x1B
#define DELETE       0x7F

static void copy(char *to, const char *from)
{
    while ((*to++ = *from++) != '\0') {
    }
}

static void put_times(struct text *echo, char c, size_t times)
{
    while (times-- > 0u) {
        text_put_char(echo, c);
    }
}

/* Draws from the cursor to the end, clears `gone` old characters after it, and returns to the cursor. */
static void draw_rest(const struct line *l, size_t gone, struct text *echo)
{
    text_put(echo, l->text + l->cursor);
    put_times(echo, ' ', gone);
    put_times(echo, '\b', l->length - l->cursor + gone);
}

static void move_to(struct line *l, size_t cursor, struct text *echo)
{
    while (l->cursor > cursor) {
        l->cursor--;
        text_put_char(echo, '\b');
    }
    while (l->cursor < cursor) {
        text_put_char(echo, l->text[l->cursor++]);
    }
}

/* Erases from `from` to the cursor, and moves the cursor there. */
static void erase_back_to(struct line *l, size_t from, struct text *echo)
{
    const size_t gone = l->cursor - from;
    const size_t end = l->cursor;
    move_to(l, from, echo);
    copy(l->text + from, l->text + end);
    l->length -= gone;
    draw_rest(l, gone, echo);
}

static void erase_to_end(struct line *l, struct text *echo)
{
    const size_t gone = l->length - l->cursor;
    l->length = l->cursor;
    l->text[l->length] = '\0';
    draw_rest(l, gone, echo);
}

static void erase_at(struct line *l, struct text *echo)
{
    if (l->cursor < l->length) {
        move_to(l, l->cursor + 1u, echo);
        erase_back_to(l, l->cursor - 1u, echo);
    }
}

static size_t word_before(const struct line *l)
{
    size_t at = l->cursor;
    while (at > 0u && l->text[at - 1u] == ' ') {
        at--;
    }
    while (at > 0u && l->text[at - 1u] != ' ') {
        at--;
    }
    return at;
}

/* The line of `back` lines ago; with 0 an empty one. */
static void recall(struct line *l, uint32_t back, struct text *echo)
{
    if (back > l->lines || back > LINE_HISTORY) {
        return;
    }
    move_to(l, l->length, echo);
    erase_back_to(l, 0u, echo);
    l->back = back;
    if (back > 0u) {
        copy(l->text, l->history[(l->lines - back) % LINE_HISTORY]);
        while (l->text[l->length] != '\0') {
            l->length++;
        }
        move_to(l, l->length, echo);
    }
}

/* Where a key moves the cursor to, or erases back to; false for other keys. */
static bool key_target(const struct line *l, char key, size_t *to)
{
    switch (key) {
    case CTRL('A'):
    case CTRL('U'):
        *to = 0u;
        return true;
    case CTRL('B'):
    case CTRL('H'):
    case DELETE:
        *to = l->cursor > 0u ? l->cursor - 1u : 0u;
        return true;
    case CTRL('E'):
        *to = l->length;
        return true;
    case CTRL('F'):
        *to = l->cursor < l->length ? l->cursor + 1u : l->length;
        return true;
    case CTRL('W'):
        *to = word_before(l);
        return true;
    default:
        return false;
    }
}

static enum line_event apply_key(struct line *l, char key, struct text *echo)
{
    size_t to;
    if (key_target(l, key, &to)) {
        const bool erases = key == CTRL('H') || key == DELETE || key == CTRL('U') || key == CTRL('W');
        if (erases) {
            erase_back_to(l, to, echo);
        } else {
            move_to(l, to, echo);
        }
        return LINE_EDITED;
    }
    switch (key) {
    case CTRL('C'):
        return LINE_DROPPED;
    case CTRL('D'):
        erase_at(l, echo);
        break;
    case CTRL('I'):
        return LINE_COMPLETE;
    case CTRL('K'):
        erase_to_end(l, echo);
        break;
    case CTRL('L'):
        return LINE_REDRAW;
    case CTRL('N'):
        recall(l, l->back - 1u, echo); /* wraps: too large is ignored */
        break;
    case CTRL('P'):
        recall(l, l->back + 1u, echo);
        break;
    case ESCAPE:
        l->key = LINE_ESCAPE;
        break;
    default:
        l->unprintable = true;
        break;
    }
    return LINE_EDITED;
}

/* The control character equivalent to a terminal key; NUL if there is none. */
static char key_of(char last, uint32_t argument)
{
    static const struct {
        char last, key;
        uint8_t argument;
    } keys[] = {
        {'A', CTRL('P'), 0}, {'B', CTRL('N'), 0}, {'C', CTRL('F'), 0}, {'D', CTRL('B'), 0},
        {'H', CTRL('A'), 0}, {'F', CTRL('E'), 0}, {'~', CTRL('A'), 1}, {'~', CTRL('D'), 3},
        {'~', CTRL('E'), 4}, {'~', CTRL('A'), 7}, {'~', CTRL('E'), 8},
    };
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++) {
        if (keys[i].last == last && keys[i].argument == argument) {
            return keys[i].key;
        }
    }
    return '\0';
}

/* A sequence is ESC, '[' or 'O', parameters from '0' to '?', and one character more that says which key it is. */
static enum line_event take_key(struct line *l, char c, struct text *echo)
{
    if (l->key == LINE_ESCAPE) {
        l->key = c == '[' || c == 'O' ? LINE_SEQUENCE : LINE_PLAIN;
        l->argument = 0;
        return LINE_EDITED;
    }
    if (c >= '0' && c <= '9') {
        l->argument = (l->argument * 10u + (uint32_t)(c - '0')) % 1000u;
        return LINE_EDITED;
    }
    if (c >= ' ' && c <= '?') {
        return LINE_EDITED;
    }
    l->key = LINE_PLAIN;
    const char key = key_of(c, l->argument);
    return key == '\0' ? LINE_EDITED : apply_key(l, key, echo);
}

void line_clear(struct line *l)
{
    l->text[0] = '\0';
    l->length = l->cursor = 0u;
    l->too_long = l->unprintable = false;
    l->key = LINE_PLAIN;
    l->back = 0u;
}

void line_insert(struct line *l, char c, struct text *echo)
{
    if (l->length == LINE_MAX) {
        l->too_long = true;
        return;
    }
    for (size_t at = ++l->length; at > l->cursor; at--) {
        l->text[at] = l->text[at - 1u];
    }
    l->text[l->cursor++] = c;
    if (echo != NULL) {
        text_put_char(echo, c);
        draw_rest(l, 0u, echo);
    }
}

enum line_event line_take(struct line *l, char c, struct text *echo)
{
    const bool second_of_crlf = c == '\n' && l->last_was_cr;
    l->last_was_cr = c == '\r';
    if (c == '\r' || c == '\n') {
        return second_of_crlf ? LINE_EDITED : LINE_ENTERED;
    }
    if (l->key != LINE_PLAIN) {
        return take_key(l, c, echo);
    }
    if (c >= ' ' && c <= '~') {
        line_insert(l, c, echo);
        return LINE_EDITED;
    }
    if (echo == NULL) {
        l->unprintable = true;
        return LINE_EDITED;
    }
    return apply_key(l, c, echo);
}

void line_draw(const struct line *l, struct text *echo)
{
    text_put(echo, l->text);
    put_times(echo, '\b', l->length - l->cursor);
}

void line_remember(struct line *l)
{
    const char *const last = l->history[(l->lines - 1u) % LINE_HISTORY];
    if (l->length > 0u && (l->lines == 0u || !text_equal(l->text, last))) {
        copy(l->history[l->lines % LINE_HISTORY], l->text);
        l->lines++;
    }
}

/* SPDX-License-Identifier: MIT */
/*
 * Lines for the storms at the console: noise, keys of a terminal, commands that are right, and such with a character changed,
 * too many or missing; and a second look at what is a command.
 */
#ifndef STORM_LINES_H
#define STORM_LINES_H

#include <stdio.h>
#include <string.h>

#include "firmware/operate/commands.h"
#include "firmware/settings/params.h"
#include "storm_random.h"

#define WORDS 8
#define BYTES 160

/* ---- what is typed ---- */

static size_t put_text(char *line, size_t at, const char *text)
{
    const size_t length = strlen(text);
    memcpy(line + at, text, length);
    return at + length;
}

static size_t put_argument(char *line, size_t at, const char *kind)
{
    const struct param_info *const p = &param_table[any((uint32_t)param_count)];
    char number[32];
    static const char *const words[] = {"index", "block",         "by", "on", "off", "show", "all", "warn",
                                        "stop",  "voltage_limit", "-"};
    if (strncmp(kind, "PARAM", 5) == 0) {
        return put_text(line, at, p->name);
    }
    if (any(3) == 0u) {
        return put_text(line, at, words[any(sizeof words / sizeof words[0])]);
    }
    (void)snprintf(number, sizeof number, any(4) == 0u ? "%d.%03d" : "%d", (int)any(20000) - 3000, (int)any(1000));
    return put_text(line, at, number);
}

static const struct command *any_row(void)
{
    uint32_t rows = 0;
    while (commands_row(rows) != NULL) {
        rows++;
    }
    return commands_row(any(rows));
}

/* A row of the table with arguments of its kinds; no `save`: it takes the time of all the others. */
static size_t put_command(char *line)
{
    const struct command *c = any_row();
    while (strcmp(c->name, "save") == 0 || strcmp(c->name, "stream") == 0 || strcmp(c->name, "machine") == 0) {
        c = any_row();
    }
    size_t at = put_text(line, 0, c->name);
    for (const char *a = c->arguments; *a != '\0'; a++) {
        if (*a == ' ') {
            line[at++] = ' ';
            if (a[1] >= 'a' && a[1] <= 'z') {
                for (a++; *a >= 'a' && *a <= 'z'; a++) {
                    line[at++] = *a;
                }
                a--;
            } else {
                at = put_argument(line, at, a + 1);
            }
        }
    }
    return at;
}

static size_t put_set(char *line)
{
    const struct param_info *const p = &param_table[any((uint32_t)param_count)];
    const int64_t span = (int64_t)p->max - p->min + 1;
    const int64_t value =
        p->min + (int64_t)(((uint64_t)any(65536) << 16 | any(65536)) % (uint64_t)(span + span / 8 + 2)) - span / 16;
    return (size_t)snprintf(line, BYTES, "set %s %lld", p->name, (long long)value);
}

static size_t mutate_line(char *line, size_t length)
{
    const uint32_t at = any((uint32_t)length);
    const char c = (char)(' ' + any(95));
    switch (any(3)) {
    case 0:
        line[at] = c;
        return length;
    case 1:
        memmove(line + at, line + at + 1, length - at - 1u);
        return length - 1u;
    default:
        memmove(line + at + 1, line + at, length - at);
        line[at] = c;
        return length + 1u;
    }
}

enum line_kind { LINE_NOISE, LINE_MUTATED, LINE_KEYS, LINE_RIGHT };

/* Something to type, of at most 2 BYTES, and what it is. */
static enum line_kind some_line(char *line, size_t *count)
{
    const uint32_t kind = any(8);
    size_t length = 0;
    if (kind == 0u) {
        for (const size_t most = any(120); length < most; length++) {
            line[length] = (char)(' ' + any(95));
        }
        *count = length;
        return LINE_NOISE;
    }
    length = kind < 4u ? put_set(line) : put_command(line);
    if (kind == 1u || kind == 4u) {
        *count = mutate_line(line, length);
        return LINE_MUTATED;
    }
    if (kind == 5u) {
        static const char *const keys[] = {"\t",   "\x1b[A", "\x1b[D", "\x1b[3~", "\x15", "\x03",
                                           "\x1b", "\xC3",   "\x01",   "\x17",    "\b"};
        for (uint32_t n = 1u + any(6); n > 0u; n--) {
            length = put_text(line, length, keys[any(sizeof keys / sizeof keys[0])]);
        }
        *count = length;
        return LINE_KEYS;
    }
    *count = length;
    return LINE_RIGHT;
}

/* ---- what is a command ---- */

struct words {
    int count;
    char word[WORDS][BYTES];
};

static struct words cut(const char *line, size_t length)
{
    struct words w = {0};
    size_t letters = 0;
    for (size_t i = 0; i <= length; i++) {
        if (i < length && line[i] != ' ') {
            if (letters == 0u && w.count < WORDS) {
                w.count++;
            }
            w.word[w.count - 1][letters++] = line[i];
        } else {
            letters = 0;
        }
    }
    return w;
}

static bool is_a_command(const struct words *w)
{
    const struct command *row;
    for (uint32_t n = 0; (row = commands_row(n)) != NULL; n++) {
        if (strcmp(w->word[0], row->name) == 0 && (size_t)w->count == command_words(row)) {
            return true;
        }
    }
    return false;
}

#endif

/* SPDX-License-Identifier: MIT */
/*
 * The line editor: characters and keys of a VT100 terminal in, a whole line out. Terminal keys come as sequences that begin
 * with ESC (ECMA-48, 5.4); unknown ones are ignored, other control characters spoil the line. Remembers the last lines for
 * the arrow keys. Thread.
 *
 *   left, right, Home, End; Ctrl-B, -F, -A, -E       move
 *   Backspace, Delete; Ctrl-H, -D                    erase a character
 *   Ctrl-U, -K, -W                                   erase to the left of the cursor, to the right, a word
 *   up, down; Ctrl-P, -N                             earlier and later lines
 *   Ctrl-C                                           a new line, nothing carried out
 *   Ctrl-L                                           draw again
 */
#ifndef FIRMWARE_OPERATE_LINE_H
#define FIRMWARE_OPERATE_LINE_H

#include <stdbool.h>
#include <stddef.h>

#include "firmware/operate/text.h"

#define LINE_MAX     80u
#define LINE_HISTORY 8u

enum line_event {
    LINE_EDITED,   /* nothing to do */
    LINE_ENTERED,  /* text is complete; the caller carries it out, then line_clear() */
    LINE_DROPPED,  /* Ctrl-C: the caller does line_clear() and prompts */
    LINE_COMPLETE, /* Tab: the caller may insert what is missing */
    LINE_REDRAW,   /* Ctrl-L: the caller prompts */
};

enum line_key_state { LINE_PLAIN, LINE_ESCAPE, LINE_SEQUENCE };

struct line {
    char text[LINE_MAX + 1u];
    size_t length, cursor;
    bool too_long;    /* a character did not fit */
    bool unprintable; /* one was neither printable nor a key */
    bool last_was_cr;
    enum line_key_state key;
    uint32_t argument; /* of the key's sequence */
    char history[LINE_HISTORY][LINE_MAX + 1u];
    uint32_t lines; /* ever put into it */
    uint32_t back;  /* how far before the newest line the display is; 0: a new one */
};

/* An empty line; the history stays. */
void line_clear(struct line *l);

/* Takes a character. Echoes to `echo`; with NULL draws nothing and accepts no keys: they spoil the line. */
enum line_event line_take(struct line *l, char c, struct text *echo);

/* Puts a character at the cursor. */
void line_insert(struct line *l, char c, struct text *echo);

/* Draws the line after a prompt, the cursor in its place. */
void line_draw(const struct line *l, struct text *echo);

/* Puts a line into the history, before its text is split into words, unless it is empty or the same as the last. */
void line_remember(struct line *l);

#endif

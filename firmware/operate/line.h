/* SPDX-License-Identifier: MIT */
/*
 * The line editor: characters and keys of a VT100 terminal in, a whole line out. Terminal keys come as sequences that begin
 * with ESC (ECMA-48, 5.4); unknown ones are ignored; other control characters make the line invalid. Keeps a history for
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
    LINE_ENTERED,  /* text is complete: the caller carries it out, then calls line_clear() */
    LINE_DROPPED,  /* Ctrl-C: the caller calls line_clear() and prompts */
    LINE_COMPLETE, /* Tab: the caller completes the word */
    LINE_REDRAW,   /* Ctrl-L: the caller prompts */
};

enum line_key_state { LINE_PLAIN, LINE_ESCAPE, LINE_SEQUENCE };

struct line {
    char text[LINE_MAX + 1u];
    size_t length, cursor;
    bool too_long;    /* a character did not fit */
    bool unprintable; /* one was neither printable nor an editing key */
    bool last_was_cr;
    enum line_key_state key;
    uint32_t argument; /* of the key's sequence */
    char history[LINE_HISTORY][LINE_MAX + 1u];
    uint32_t lines; /* ever stored in it */
    uint32_t back;  /* how many lines back the displayed one is; 0: a new line */
};

/* An empty line; the history stays. */
void line_clear(struct line *l);

/* Handles a character. Echoes to `echo`; with NULL there is no echo, and editing keys make the line invalid. */
enum line_event line_take(struct line *l, char c, struct text *echo);

/* Inserts a character at the cursor. */
void line_insert(struct line *l, char c, struct text *echo);

/* Draws the line after a prompt, with the cursor at its position. */
void line_draw(const struct line *l, struct text *echo);

/* Stores the line in the history, unless it is empty or the same as the last. Before its text is split into words. */
void line_remember(struct line *l);

#endif

/* SPDX-License-Identifier: MIT */
#include "firmware/console.h"

#include <stdbool.h>
#include <stddef.h>

#include "drivers/mss/mmuart.h"
#include "firmware/commands.h"
#include "firmware/text.h"

#define LINE_MAX  80u
#define BACKSPACE '\b'
#define DELETE    0x7F

static char line[LINE_MAX + 1];
static size_t length;
static bool too_long;
static bool unprintable;
static bool last_was_cr;

void console_prompt(void)
{
    text_put("> ");
    for (size_t i = 0; i < length; i++) {
        text_put_char(line[i]);
    }
}

static void start_line(void)
{
    length = 0;
    too_long = false;
    unprintable = false;
    console_prompt();
}

static void finish_line(void)
{
    text_put_line("");
    line[length] = '\0';
    if (too_long) {
        text_put_line("error: line longer than 80 characters; ignored");
    } else if (unprintable) {
        text_put_line("error: line with unprintable characters; ignored");
    } else {
        commands_execute(line);
    }
    start_line();
}

static void erase(void)
{
    if (length > 0u) {
        length--;
        text_put("\b \b");
    }
}

static void append(char c)
{
    if (c < ' ' || c > '~') {
        unprintable = true;
    } else if (length == LINE_MAX) {
        too_long = true;
    } else {
        line[length++] = c;
        text_put_char(c);
    }
}

static void take(char c)
{
    const bool second_of_crlf = c == '\n' && last_was_cr;
    last_was_cr = c == '\r';
    if (c == '\r' || c == '\n') {
        if (!second_of_crlf) {
            finish_line();
        }
    } else if (c == BACKSPACE || c == DELETE) {
        erase();
    } else {
        append(c);
    }
}

void console_poll(void)
{
    char c;
    while (mmuart0_get(&c)) {
        take(c);
    }
}

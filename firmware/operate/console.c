/* SPDX-License-Identifier: MIT */
#include "firmware/operate/console.h"

#include "drivers/mss/mmuart.h"
#include "firmware/operate/commands.h"
#include "firmware/operate/messages.h"
#include "firmware/operate/postmortem_text.h"
#include "firmware/operate/text.h"
#include "firmware/settings/config.h"

#define BACKSPACE '\b'
#define DELETE    0x7F

static void prompt(const struct console *k)
{
    text_put("> ");
    for (size_t i = 0; i < k->length; i++) {
        text_put_char(k->line[i]);
    }
}

static void start_line(struct console *k)
{
    k->length = 0;
    k->too_long = false;
    k->unprintable = false;
    prompt(k);
}

static void finish_line(struct console *k)
{
    axis_hear(k->axis);
    text_put_line("");
    k->line[k->length] = '\0';
    if (k->too_long) {
        text_put_line("error: line longer than 80 characters; ignored");
    } else if (k->unprintable) {
        text_put_line("error: line with unprintable characters; ignored");
    } else {
        commands_execute(k->axis, k->line);
    }
    start_line(k);
}

static void erase(struct console *k)
{
    if (k->length > 0u) {
        k->length--;
        text_put("\b \b");
    }
}

static void append(struct console *k, char c)
{
    if (c < ' ' || c > '~') {
        k->unprintable = true;
    } else if (k->length == CONSOLE_LINE_MAX) {
        k->too_long = true;
    } else {
        k->line[k->length++] = c;
        text_put_char(c);
    }
}

static void take(struct console *k, char c)
{
    const bool second_of_crlf = c == '\n' && k->last_was_cr;
    k->last_was_cr = c == '\r';
    if (c == '\r' || c == '\n') {
        if (!second_of_crlf) {
            finish_line(k);
        }
    } else if (c == BACKSPACE || c == DELETE) {
        erase(k);
    } else {
        append(k, c);
    }
}

/* Between two lines of the user's. */
static void announce_fault(struct console *k)
{
    const uint32_t fault = k->axis->faults.cause;
    if (fault == k->announced) {
        return;
    }
    k->announced = fault;
    if (fault != FAULT_NONE) {
        text_put("\r\nfault: ");
        text_put(message_of_fault(fault));
        text_put_line("; see 'fault', then 'clear'");
        prompt(k);
    }
}

/* Each once, until the drive forgets them. */
static void announce_warnings(struct console *k)
{
    for (uint32_t cause = 0; cause < FAULT_COUNT; cause++) {
        const uint32_t bit = 1u << (cause % 32u);
        uint32_t *const said = &k->warned[cause / 32u];
        if (!reaction_warned(&k->axis->reactions, (enum fault)cause)) {
            *said &= ~bit;
        } else if ((*said & bit) == 0u) {
            *said |= bit;
            text_put("\r\nwarning: ");
            text_put_line(message_of_fault((enum fault)cause));
            prompt(k);
        }
    }
}

void console_start(struct console *k, struct axis *axis)
{
    *k = (struct console){.axis = axis};
    text_put_line("");
    text_put_line("mssfoc " CONFIG_VERSION ", 'help' lists the commands");
    postmortem_print();
    prompt(k);
}

void console_poll(struct console *k)
{
    char c;
    while (mmuart0_get(&c)) {
        take(k, c);
    }
    announce_fault(k);
    announce_warnings(k);
}

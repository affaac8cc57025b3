/* SPDX-License-Identifier: MIT */
#include "firmware/operate/console.h"

#include "firmware/operate/commands.h"
#include "firmware/operate/messages.h"
#include "firmware/operate/postmortem_text.h"
#include "firmware/operate/text.h"
#include "firmware/settings/config.h"

#define BACKSPACE '\b'
#define DELETE    0x7F

static struct text *out(struct console *k)
{
    return &k->session.out;
}

static void prompt(struct console *k)
{
    if (k->session.out.lost) {
        k->session.out.lost = false;
        text_put_line(out(k), "(output was lost: the line did not take it)");
    }
    text_put(out(k), "> ");
    for (size_t i = 0; i < k->length; i++) {
        text_put_char(out(k), k->line[i]);
    }
}

static void start_line(struct console *k)
{
    k->length = 0;
    k->too_long = false;
    k->unprintable = false;
    k->incomplete = false;
    prompt(k);
}

static void finish_line(struct console *k)
{
    axis_hear(k->session.axis);
    text_put_line(out(k), "");
    k->line[k->length] = '\0';
    if (k->incomplete) {
        text_put_line(out(k), "error: characters were lost; line ignored");
    } else if (k->too_long) {
        text_put_line(out(k), "error: line longer than 80 characters; ignored");
    } else if (k->unprintable) {
        text_put_line(out(k), "error: line with unprintable characters; ignored");
    } else {
        commands_execute(&k->session, k->line);
    }
    start_line(k);
}

static void erase(struct console *k)
{
    if (k->length > 0u) {
        k->length--;
        text_put(out(k), "\b \b");
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
        text_put_char(out(k), c);
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
    const uint32_t fault = k->session.axis->faults.cause;
    if (fault == k->announced) {
        return;
    }
    k->announced = fault;
    if (fault != FAULT_NONE) {
        text_put(out(k), "\r\nfault: ");
        text_put(out(k), message_of_fault(fault));
        text_put_line(out(k), "; see 'fault', then 'clear'");
        prompt(k);
    }
}

/* Each once, until the drive forgets them. */
static void announce_warnings(struct console *k)
{
    for (uint32_t cause = 0; cause < FAULT_COUNT; cause++) {
        const uint32_t bit = 1u << (cause % 32u);
        uint32_t *const said = &k->warned[cause / 32u];
        if (!reaction_warned(&k->session.axis->reactions, (enum fault)cause)) {
            *said &= ~bit;
        } else if ((*said & bit) == 0u) {
            *said |= bit;
            text_put(out(k), "\r\nwarning: ");
            text_put_line(out(k), message_of_fault((enum fault)cause));
            prompt(k);
        }
    }
}

void console_start(struct console *k, const struct session *session)
{
    *k = (struct console){.session = *session};
    text_put_line(out(k), "");
    text_put_line(out(k), "mssfoc " CONFIG_VERSION ", 'help' lists the commands");
    postmortem_print(out(k), session->last_life);
    prompt(k);
}

void console_poll(struct console *k)
{
    char c;
    while (mmuart_get(k->session.out.uart, &c, &k->incomplete)) {
        take(k, c);
    }
    announce_fault(k);
    announce_warnings(k);
}

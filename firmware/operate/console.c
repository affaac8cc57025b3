/* SPDX-License-Identifier: MIT */
#include "firmware/operate/console.h"

#include "firmware/operate/commands.h"
#include "firmware/operate/completion.h"
#include "firmware/operate/keeping_text.h"
#include "firmware/operate/messages.h"
#include "firmware/operate/postmortem_text.h"
#include "firmware/operate/text.h"
#include "firmware/settings/config.h"

static struct text *out(struct console *k)
{
    return &k->session.out;
}

/* Echoes to people only. */
static struct text *echo(struct console *k)
{
    return k->session.machine ? NULL : out(k);
}

static void prompt(struct console *k)
{
    if (k->session.out.lost) {
        k->session.out.lost = false;
        text_put_line(out(k), "(output was lost: the line did not take it)");
    }
    if (!k->session.machine) {
        text_put(out(k), "> ");
        line_draw(&k->line, out(k));
    }
}

static void start_line(struct console *k)
{
    line_clear(&k->line);
    k->incomplete = false;
    prompt(k);
}

static void execute(struct console *k)
{
    if (k->incomplete) {
        text_put_line(out(k), "error: characters were lost; line ignored");
    } else if (k->line.too_long) {
        text_put_line(out(k), "error: line longer than 80 characters; ignored");
    } else if (k->line.unprintable) {
        text_put_line(out(k), "error: line with unprintable characters; ignored");
    } else {
        line_keep(&k->line);
        commands_execute(&k->session, k->line.text);
    }
}

static void finish_line(struct console *k)
{
    const bool machine = k->session.machine;
    drive_hear(k->session.axis);
    stream_hear(&k->session.stream, k->session.axis->time_ms);
    if (!machine) {
        text_put_line(out(k), "");
    }
    execute(k);
    if (machine) {
        text_put_line(out(k), ".");
    }
    start_line(k);
}

static void take(struct console *k, char c)
{
    switch (line_take(&k->line, c, echo(k))) {
    case LINE_ENTERED:
        finish_line(k);
        break;
    case LINE_DROPPED:
        text_put_line(out(k), "^C");
        start_line(k);
        break;
    case LINE_COMPLETE:
        if (completion_of(&k->line, out(k))) {
            prompt(k);
        }
        break;
    case LINE_REDRAW:
        text_put_line(out(k), "");
        prompt(k);
        break;
    case LINE_EDITED:
        break;
    }
}

/* A message between two of the user's lines starts a new line. */
static void leave_line(struct console *k)
{
    if (!k->session.machine) {
        text_put_line(out(k), "");
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
        leave_line(k);
        text_put(out(k), "fault: ");
        text_put(out(k), message_of_fault(fault));
        text_put_line(out(k), "; see 'fault', then 'clear'");
        prompt(k);
    }
}

static void announce_warning(struct console *k, enum fault cause)
{
    leave_line(k);
    text_put(out(k), "warning: ");
    text_put_line(out(k), message_of_fault(cause));
    prompt(k);
}

/* Each once, until the drive clears them. Word by word: this runs each time the thread wakes. */
static void announce_warnings(struct console *k)
{
    for (uint32_t word = 0; word < FAULT_WORDS; word++) {
        const uint32_t warnings = k->session.axis->reports.warned[word];
        uint32_t unsaid = warnings & ~k->warned[word];
        k->warned[word] = warnings;
        for (; unsaid != 0u; unsaid &= unsaid - 1u) {
            announce_warning(k, (enum fault)(word * 32u + (uint32_t)__builtin_ctz(unsaid)));
        }
    }
}

void console_start(struct console *k, const struct session *session)
{
    *k = (struct console){.session = *session};
    text_put_line(out(k), "");
    text_put_line(out(k), "mssfoc " CONFIG_VERSION ", 'help' lists the commands");
    postmortem_print(out(k), session->last_life);
    keeping_text_loaded(out(k), session->kept);
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
    stream_poll(&k->session.stream, out(k), k->session.scope);
}

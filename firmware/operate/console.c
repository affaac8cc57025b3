/* SPDX-License-Identifier: MIT */
#include "firmware/operate/console.h"

#include "firmware/operate/messages.h"
#include "firmware/settings/config.h"

static struct text *out(struct console *k)
{
    return &k->session.out;
}

static struct axis *axis_numbered(const struct console *k, uint32_t axis)
{
    return AXIS_COUNT == 1u ? k->session.axis : &k->session.axes[axis];
}

/* Echo is for people only. */
static struct text *echo_to(struct console *k)
{
    return k->session.machine ? NULL : out(k);
}

static void prompt(struct console *k)
{
    if (k->session.out.lost) {
        k->session.out.lost = false;
        text_put(out(k), "(output was lost: the line did not take it)\n");
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
        text_put(out(k), "error: characters were lost; line ignored\n");
    } else if (k->line.too_long) {
        text_put(out(k), "error: line longer than 80 characters; ignored\n");
    } else if (k->line.unprintable) {
        text_put(out(k), "error: line with unprintable characters; ignored\n");
    } else {
        line_remember(&k->line);
        commands_execute(&k->session, k->line.text);
    }
}

static void finish_line(struct console *k)
{
    const bool machine = k->session.machine;
    for (uint32_t axis = 0; axis < AXIS_COUNT; axis++) {
        owner_message(axis_numbered(k, axis), OWNER_CONSOLE);
    }
    stream_keep_alive(&k->session.stream, k->session.axis->time_ms);
    if (!machine) {
        text_put(out(k), "\n");
    }
    execute(k);
    if (machine) {
        text_put(out(k), ".\n");
    }
    start_line(k);
}

/* True if it has ended a line. */
static bool take_character(struct console *k, char c)
{
    switch (line_take(&k->line, c, echo_to(k))) {
    case LINE_ENTERED:
        finish_line(k);
        return true;
    case LINE_DROPPED:
        text_put(out(k), "^C\n");
        start_line(k);
        break;
    case LINE_COMPLETE:
        if (completion_of(&k->line, out(k))) {
            prompt(k);
        }
        break;
    case LINE_REDRAW:
        text_put(out(k), "\n");
        prompt(k);
        break;
    case LINE_EDITED:
        break;
    }
    return false;
}

/* An event, between two lines of the user. */
static void announce(struct console *k, uint32_t axis, const char *kind, const char *what, const char *what_next)
{
    if (!k->session.machine) {
        text_put(out(k), "\n");
    }
    text_print(out(k), "%s: ", kind);
    put_axis(out(k), axis);
    text_print(out(k), "%s%s\n", what, what_next);
    prompt(k);
}

static void announce_fault(struct console *k, uint32_t axis)
{
    const uint32_t fault = axis_numbered(k, axis)->faults.cause;
    if (fault != k->announced[axis] && fault != FAULT_NONE) {
        announce(k, axis, "fault", message_of_fault((enum fault)fault), "; see 'fault', then 'clear'");
    }
    k->announced[axis] = fault;
}

static void announce_stop(struct console *k, uint32_t axis)
{
    const uint32_t by = axis_numbered(k, axis)->owner.stopped_by;
    if (by != k->stopped_by[axis] && by > OWNER_CONSOLE) {
        announce(k, axis, "warning", message_of_owner(by), " has stopped the drive");
    }
    k->stopped_by[axis] = by;
}

/* Each once, until the drive clears it. By words, because this runs each time the thread wakes. */
static void announce_warnings(struct console *k, uint32_t axis)
{
    for (uint32_t word = 0; word < FAULT_WORDS; word++) {
        const uint32_t warnings = axis_numbered(k, axis)->reports.warned[word];
        uint32_t fresh = warnings & ~k->warned[axis][word];
        k->warned[axis][word] = warnings;
        for (; fresh != 0u; fresh &= fresh - 1u) {
            const uint32_t cause = word * 32u + (uint32_t)__builtin_ctz(fresh);
            announce(k, axis, "warning", message_of_fault((enum fault)cause), "");
        }
    }
}

static void announce_progress(struct console *k, uint32_t axis)
{
    const char *const done = progress_message(&k->session, axis);
    if (done != NULL) {
        announce(k, axis, "done", done, "");
    }
}

static void print_loaded(struct console *k, uint32_t axis)
{
    put_axis(out(k), axis);
    store_print_loaded(out(k), &k->session.loaded[axis]);
}

void console_start(struct console *k, const struct session *session)
{
    *k = (struct console){.session = *session};
    text_put(out(k), "\n");
    text_put(out(k), "mssfoc " CONFIG_VERSION ", 'help' lists the commands\n");
    postmortem_print(out(k), session->last_run);
    for (uint32_t axis = 0; axis < AXIS_COUNT && FEATURE_IN(SETTINGS); axis++) {
        print_loaded(k, axis);
    }
    prompt(k);
}

bool console_poll(struct console *k)
{
    char c;
    bool ended = false;
    while (!ended && mmuart_get(k->session.out.uart, &c, &k->incomplete)) {
        ended = take_character(k, c);
    }
    for (uint32_t axis = 0; axis < AXIS_COUNT; axis++) {
        announce_fault(k, axis);
        announce_stop(k, axis);
        announce_warnings(k, axis);
        announce_progress(k, axis);
    }
    if (FEATURE_IN(SCOPE) && k->session.scope != NULL) {
        (void)sweep_poll(&k->session.scope->sweep);
        stream_poll(&k->session.stream, out(k), k->session.scope);
    }
    return ended;
}

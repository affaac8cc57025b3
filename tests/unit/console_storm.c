/* SPDX-License-Identifier: MIT */
/*
 * A million lines at the console: noise, keys of a terminal, commands that are right, and such with a character changed, too
 * many or missing. Who judges knows what was typed and cuts it into words by itself: a line that is no command, or has another
 * number of words, leaves the whole axis as it was; `set` that is right changes its parameter and no other, and only while off.
 *
 *     console_storm LINES SEED        prints the counts by name; what must not be is counted, too
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "envm.h"
#include "firmware/operate/console.h"
#include "storm_lines.h"

extern char host_said[], host_heard[];
extern uint32_t host_said_bytes, host_heard_bytes, host_heard_taken;

static struct {
    long lines, noise, keys, right, mutated, set, commands;
    long changed_by_nothing, other_changed, not_set, set_while_on, out_of_range, unanswered;
} counts;

static struct fabric fabric;
static struct axis axis, before;
static struct scope scope;
static struct postmortem last_life;
static struct nvm_report kept;
static struct slots slots;
static struct console console;
static volatile uint32_t pend;

static void enter(void)
{
}

static void (*vector)(void) = enter;
static const struct loop_handlers handlers = {.vector = &vector,
                                              .handler = {enter, enter, enter, enter, enter},
                                              .weakening = enter,
                                              .overmodulating = enter,
                                              .rippled = enter};

/* ---- who judges ---- */

/* The parameter that `set` sets, and its value; NULL if it sets none. */
static const struct param_info *sets(const struct words *w, long *value)
{
    if (w->count != 3 || strcmp(w->word[0], "set") != 0) {
        return NULL;
    }
    char *end;
    *value = strtol(w->word[2], &end, 10);
    const size_t digits = strspn(w->word[2] + (w->word[2][0] == '-' || w->word[2][0] == '+' ? 1 : 0), "0123456789");
    for (size_t i = 0; i < param_count; i++) {
        const struct param_info *const p = &param_table[i];
        if (strcmp(p->name, w->word[1]) == 0) {
            return *end == '\0' && digits > 0u && digits < 15u && *value >= p->min && *value <= p->max ? p : NULL;
        }
    }
    return NULL;
}

static bool may_change_many(const struct words *w)
{
    static const char *const names[] = {"load", "defaults", "identify"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        if (strcmp(w->word[0], names[i]) == 0) {
            return true;
        }
    }
    return false;
}

static void judge_set(const struct words *w, bool off)
{
    long value;
    const struct param_info *const p = sets(w, &value);
    struct params wanted = before.params;
    if (p != NULL && off) {
        param_set(&wanted, p, (int32_t)value);
        counts.set++;
    }
    counts.not_set += p != NULL && off && param_get(&axis.params, p) != (int32_t)value;
    counts.set_while_on += !off && memcmp(&axis.params, &before.params, sizeof wanted) != 0;
    counts.other_changed += !may_change_many(w) && memcmp(&axis.params, &wanted, sizeof wanted) != 0;
}

static void judge(const char *line, size_t length, bool off)
{
    bool plain = length <= LINE_MAX;
    for (size_t i = 0; i < length; i++) {
        plain = plain && line[i] >= ' ' && line[i] <= '~';
    }
    for (size_t i = 0; i < param_count; i++) {
        const int32_t value = param_get(&axis.params, &param_table[i]);
        counts.out_of_range += value < param_table[i].min || value > param_table[i].max;
    }
    if (length > LINE_MAX || plain) {
        const struct words w = cut(line, length);
        before.command_ms = axis.command_ms; /* somebody speaks, whatever he says */
        if (length > LINE_MAX || !is_a_command(&w)) {
            counts.changed_by_nothing += memcmp(&axis, &before, sizeof axis) != 0;
        } else {
            counts.commands++;
            judge_set(&w, off);
        }
    }
}

static void count(enum line_kind kind)
{
    counts.noise += kind == LINE_NOISE;
    counts.keys += kind == LINE_KEYS;
    counts.mutated += kind == LINE_MUTATED;
    counts.right += kind == LINE_RIGHT;
}

static void type(const char *line, size_t length)
{
    memcpy(host_heard, line, length);
    host_heard[length] = '\r';
    host_heard_bytes = (uint32_t)length + 1u;
    host_heard_taken = host_said_bytes = 0;
    while (console_poll(&console)) {
    }
    counts.unanswered += host_said_bytes < 2u || memcmp(&host_said[host_said_bytes - 2u], "> ", 2) != 0;
}

int main(int argc, char **argv)
{
    counts.lines = argc > 1 ? atol(argv[1]) : 1000000;
    seed = argc > 2 ? (uint32_t)atol(argv[2]) : 12345u;
    drive_init(&axis, &fabric);
    axis.fabric_doubt = 0;
    axis.loop.handlers = &handlers;
    host_envm_new(&axis, 8e-3, 1u);
    slots = host_slots();
    scope_init(&scope, &axis, enter, &pend, 1u);
    const struct session session = {
        .axis = &axis, .scope = &scope, .last_life = &last_life, .slots = &slots, .loaded = &kept};
    console_start(&console, &session);
    const struct axis fresh = axis;
    for (long n = 0; n < counts.lines; n++) {
        char line[2 * BYTES] = {0};
        const bool off = any(2) == 0u;
        axis = fresh;
        axis.state = off ? AXIS_SWITCH_ON_DISABLED : AXIS_OPERATION_ENABLED;
        before = axis;
        size_t length;
        count(some_line(line, &length));
        type(line, length);
        judge(line, length, off);
    }
    printf("lines %ld\nnoise %ld\nkeys %ld\nright %ld\nmutated %ld\nset %ld\ncommands %ld\n", counts.lines,
           counts.noise, counts.keys, counts.right, counts.mutated, counts.set, counts.commands);
    printf(
        "changed_by_nothing %ld\nother_changed %ld\nnot_set %ld\nset_while_on %ld\nout_of_range %ld\nunanswered %ld\n",
        counts.changed_by_nothing, counts.other_changed, counts.not_set, counts.set_while_on, counts.out_of_range,
        counts.unanswered);
    return 0;
}

/* SPDX-License-Identifier: MIT */
/* Who owns the drive, by what was said to it and not by what it holds. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "swarm.h"

struct judged judged[AXIS_COUNT];
struct told told;

void judge_new(void)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        const struct params *const now = &world.axes[n].params;
        judged[n] =
            (struct judged){.lost = "power-on", .when = "", .shown = {0x40, 0x40}, .stored = *now, .before = *now};
    }
    told.consumer_ms = 0u;
    told.typed[0] = '\0';
}

void judge_rebooted(void)
{
    for (uint32_t n = 0; n < AXIS_COUNT && world.powered; n++) {
        const struct params *const now = &world.axes[n].params;
        if (memcmp(now, &judged[n].stored, sizeof *now) != 0 && memcmp(now, &judged[n].before, sizeof *now) != 0) {
            judge_wrong("settings are not those that were saved");
        }
    }
    if (world.powered) {
        judge_new();
    }
}

bool judge_watches(uint32_t axis)
{
    const bool beats = judged[axis].owner == OWNER_CAN && told.consumer_ms != 0u;
    return beats || world.axes[axis].params.command_timeout_ms != 0;
}

/* ---- who owns the drive ---- */

void owner_given_up(struct judged *j, const char *why, uint32_t within_ms)
{
    const uint32_t n = (uint32_t)(j - judged);
    if (j->owner != OWNER_NONE) {
        j->owner = j->let_go = OWNER_NONE;
        j->lost = why;
        j->when = world_operates(n)                          ? "in operation"
                  : world_is_live(n)                         ? "at its start"
                  : world.axes[n].faults.cause != FAULT_NONE ? "in a fault"
                                                             : "before its start";
        j->lost_ms = world.now_ms;
        /* what is said to a thread that does not come is heard behind its fault, whose reaction is a stop */
        j->within_ms = world.hung_ms > 0 ? (uint32_t)world.hung_ms + STOP_MS : within_ms;
    }
}

void judge_turn(enum owner of)
{
    for (uint32_t n = 0; n < AXIS_COUNT && world.powered; n++) {
        struct judged *const j = &judged[n];
        const bool wants = world_wants(n), begins = world.axes[n].switching.under_way;
        /* another's enabling may wait for the owner's off, and come in the same turn */
        if (wants && (!j->wanted || (begins && !j->began && of != OWNER_NONE))) {
            if (of == OWNER_NONE) {
                judge_wrong("it wants to be on by itself, after %s %s", j->lost, j->when);
            }
            j->owner = of;
            j->since_ms = world.now_ms;
            j->asked_rpm[OWNER_CONSOLE] = 0;
            j->free = j->measures = world.axes[n].request == AXIS_REQUEST_IDENTIFY;
            j->returns = false;
        }
        j->wanted = wants;
        j->began = begins;
        if (world.axes[n].state != j->state) { /* a state may last less than a millisecond on a bus */
            judge_words(n);
        }
    }
}

/*
 * What goes on goes on as it is, a start towards 0; but a restart is the former owner's wish. Of a word and a take-over in the
 * same turn the drive may hear the take-over first: the word is then another's, and refused.
 */
void judge_take(enum owner line, uint32_t axis)
{
    struct judged *const j = &judged[axis];
    if (j->owner == OWNER_NONE && j->let_go != OWNER_NONE && world.now_ms - j->lost_ms <= 1u) {
        j->owner = j->let_go;
    }
    if (j->owner != OWNER_NONE && j->owner != line) {
        j->asked_rpm[line] = j->said_rpm[line] = world_operates(axis) ? j->asked_rpm[j->owner] : 0;
        j->owner = line;
        j->since_ms = world.now_ms;
        j->returns = true;
        if (world.axes[axis].faults.cause != FAULT_NONE) {
            owner_given_up(j, "a take-over", STOP_MS);
        }
    }
}

void judge_lost(enum owner line, const char *why)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        if (judged[n].owner == line) {
            owner_given_up(&judged[n], why, world_operates(n) ? STOP_MS : START_MS);
        }
    }
}

/* Off, whoever commands; and the objects are as at power-on. */
void judge_reset_node(void)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        judged[n].said_rpm[OWNER_CAN] = judged[n].asked_rpm[OWNER_CAN] = 0;
        judged[n].word[OWNER_CAN] = 0u;
        owner_given_up(&judged[n], "NMT reset node", OFF_MS + LATE_MS);
    }
    told.consumer_ms = 0u;
}

/* The owner's counts, anybody's where there is none. */
void judge_heard(enum owner line, uint32_t axis)
{
    struct judged *const j = &judged[axis % AXIS_COUNT];
    if (j->owner == OWNER_NONE || j->owner == line) {
        j->heard_ms = world.now_ms;
    }
}

void judge_beat(uint32_t consumer_ms)
{
    told.beat_ms = world.now_ms + (uint32_t)world.hung_ms; /* when the thread hears of it */
    told.consumer_ms = consumer_ms;
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        judge_heard(OWNER_CAN, n);
    }
}

/*
 * Without voltage or for a quick stop, a word is everybody's; else the owner's levels are the wish, and others' words are
 * refused while one commands. A reset forgets the fault and what waits for its end.
 */
void judge_word(enum owner line, uint32_t axis, uint32_t word, const int32_t *rpm)
{
    struct judged *const j = &judged[axis];
    const bool stops = (word & 0x06u) != 0x06u, faulty = world.axes[axis].faults.cause != FAULT_NONE;
    const bool counts = j->owner == OWNER_NONE || j->owner == line || faulty || stops;
    const bool refused = faulty && (word & 0x0Fu) == 0x0Fu && j->owner != OWNER_NONE && j->owner != line;
    const uint32_t rising = refused ? 0u : word & ~j->word[line]; /* with its edges: it enables, and another commands */
    j->word[line] = refused ? j->word[line] : word;
    if (counts) {
        j->said_rpm[line] = rpm != NULL ? *rpm : j->said_rpm[line];
        j->asked_rpm[line] = (word & 0x100u) != 0u ? 0 : j->said_rpm[line];
        j->returns = j->returns && (j->owner != line || faulty);
    }
    if (stops || (j->owner == line && (word & 0x0Fu) != 0x0Fu)) {
        const enum owner lets_go = stops ? OWNER_NONE : j->owner;
        owner_given_up(j, j->owner == line ? "its owner's word" : "another's word",
                       (word & 0x06u) == 0x02u ? STOP_MS : OFF_MS + LATE_MS);
        j->let_go = lets_go;
    }
    if (faulty && (rising & 0x80u) != 0u) {
        owner_given_up(j, "a reset of the fault", STOP_MS);
    }
}

/* ---- what is typed ---- */

/* The axis of "axis 2 off", and what is behind it. */
static uint32_t axis_of(const char **text)
{
    if (strncmp(*text, "axis ", 5) != 0) {
        return 0;
    }
    const uint32_t axis = (uint32_t)((*text)[5] - '1') % AXIS_COUNT;
    *text += 7;
    return axis;
}

bool judge_type(const char *text)
{
    if (told.typed[0] != '\0' || !world_type(text)) {
        return false;
    }
    snprintf(told.typed, sizeof told.typed, "%s", text);
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        judge_heard(OWNER_CONSOLE, n);
    }
    struct judged *const j = &judged[axis_of(&text)];
    if (strcmp(text, "save") == 0) {
        j->before = j->stored;
        j->stored = world.axes[j - judged].params;
    }
    return true;
}

static bool begins_with(const char *text, const char *word)
{
    return strncmp(text, word, strlen(word)) == 0;
}

static void accepted(struct judged *j, const char *text)
{
    const bool speed = begins_with(text, "speed ");
    const bool moves = speed || begins_with(text, "torque") || begins_with(text, "pp") || begins_with(text, "hm") ||
                       begins_with(text, "cs");
    if (moves && j->owner != OWNER_CONSOLE && j->owner != OWNER_NONE) {
        judge_wrong("the console's set-point is taken although %s owns the drive", line_names[j->owner]);
    }
    if (strcmp(text, "off") == 0) {
        owner_given_up(j, "off", OFF_MS + LATE_MS);
    } else if (strcmp(text, "quickstop") == 0) {
        owner_given_up(j, "quickstop", STOP_MS);
    } else if (strcmp(text, "clear") == 0) {
        owner_given_up(j, "clear", OFF_MS);
    } else if (strcmp(text, "take") == 0) {
        judge_take(OWNER_CONSOLE, (uint32_t)(j - judged));
    } else if (moves) {
        j->asked_rpm[OWNER_CONSOLE] = speed ? atoi(text + 6) : j->asked_rpm[OWNER_CONSOLE];
        j->free = j->free || !speed;
        j->returns = false;
    }
}

void judge_answer(const char *text)
{
    const bool refused = strstr(text, "error: ") != NULL;
    const char *typed = told.typed;
    struct judged *const j = &judged[axis_of(&typed)];
    if (typed[0] != '\0' && !refused && strstr(text, "\nok") != NULL) {
        accepted(j, typed);
    }
    if (strcmp(typed, "save") == 0) {
        j->stored = refused ? j->before : j->stored;
        j->before = j->stored;
    }
    told.typed[0] = '\0';
}

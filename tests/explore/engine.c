/* SPDX-License-Identifier: MIT */
#include "engine.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "adapter.h"

#define NODES_MOST      (1u << 23)
#define SLOTS           (NODES_MOST * 2u)
#define NONE            UINT32_MAX
#define EVENTS_MOST     96
#define PLACES_MOST     48
#define VIOLATIONS_MOST 32
#define SAME_MOST       4
#define FIRST_S         0.2
#define STEP_S          0.05

struct node {
    uint64_t hash[2];
    uint32_t parent;
    uint8_t event, place;
};

static struct node *nodes;
static uint8_t **memory; /* of those whose events are still to come */
static uint32_t *slots;
static uint32_t count;
static uint64_t seen[PLACES_MOST][EVENTS_MOST];
static struct {
    char what[80];
    uint64_t times;
} violations[VIOLATIONS_MOST];
static int kinds;

static void *need(void *p)
{
    if (p == NULL) {
        fprintf(stderr, "explore: out of memory after %u states; a setup with fewer groups of events needs less\n",
                count);
        exit(2);
    }
    return p;
}

static void hash_key(uint64_t hash[2])
{
    uint8_t key[KEY_MOST];
    const size_t length = explore_key(key);
    hash[0] = 0xCBF29CE484222325u;
    hash[1] = length;
    for (size_t n = 0; n < length; n++) {
        hash[0] = (hash[0] ^ key[n]) * 0x100000001B3u;
        hash[1] = (hash[1] + key[n]) * 0x9E3779B97F4A7C15u;
        hash[1] ^= hash[1] >> 29;
    }
}

/* The present state, if it is a new one; NONE if not. */
static uint32_t add(uint32_t parent, int event)
{
    struct node n = {.parent = parent, .event = (uint8_t)event, .place = (uint8_t)explore_place()};
    hash_key(n.hash);
    uint32_t slot = (uint32_t)n.hash[0] % SLOTS;
    for (; slots[slot] != NONE; slot = (slot + 1u) % SLOTS) {
        if (memcmp(nodes[slots[slot]].hash, n.hash, sizeof n.hash) == 0) {
            return NONE;
        }
    }
    if (count == NODES_MOST) {
        need(NULL);
    }
    slots[slot] = count;
    nodes[count] = n;
    memory[count] = need(malloc(explore_bytes));
    memcpy(memory[count], explore_memory, explore_bytes);
    return count++;
}

/* ---- what is printed ---- */

/* For `make run SCENARIO=file`: what of it a console can type, or the twin can do. */
static void print_scenario(const struct explore_event *const *way, int length)
{
    printf("  as a scenario, as far as the twin can do it:\n    title = \"a way that make explore has found\"\n");
    printf("    end_s = %.2f\n", FIRST_S + STEP_S * (length + 1));
    for (int n = length - 1; n >= 0; n--) {
        const char *const played = way[n]->played;
        if (played == NULL) {
            continue;
        }
        printf("    [[step]]\n    t_s = %.2f\n", FIRST_S + STEP_S * (length - 1 - n));
        if (played[0] == '=') {
            printf("    event = \"%.*s\"\n    args = %s\n", (int)strcspn(played + 1, " "), played + 1,
                   strchr(played, '['));
        } else {
            printf("    console = \"%s\"\n", played);
        }
    }
}

void engine_print_way(uint32_t node, int last)
{
    const struct explore_event *way[1024];
    int length = 0;
    if (last >= 0) {
        way[length++] = &explore_events[last];
    }
    for (uint32_t at = node; nodes[at].parent != NONE && length < 1024; at = nodes[at].parent) {
        way[length++] = &explore_events[nodes[at].event];
    }
    for (int n = length - 1; n >= 0; n--) {
        printf("    %s\n", way[n]->name);
    }
    print_scenario(way, length);
}

/* The first of each kind has the shortest way. */
static void violated(uint32_t node, int event, struct totals *t)
{
    t->violations++;
    for (int n = 0; n < kinds; n++) {
        if (strcmp(violations[n].what, explore_wrong) == 0) {
            violations[n].times++;
            return;
        }
    }
    if (kinds < VIOLATIONS_MOST) {
        snprintf(violations[kinds].what, sizeof violations[0].what, "%s", explore_wrong);
        violations[kinds++].times = 1;
    }
    printf("\nVIOLATION: %s, by%s\n", explore_wrong, event < 0 ? " `off` and 20 s behind" : "");
    engine_print_way(node, event);
    fflush(stdout);
}

static void print_places(void)
{
    uint64_t pairs = 0;
    printf("  %-24s %9s  events seen in it\n", "place", "states");
    for (int place = 0; place < explore_place_count; place++) {
        uint64_t states = 0, events = 0;
        for (uint32_t n = 0; n < count; n++) {
            states += nodes[n].place == place;
        }
        for (int e = 0; e < explore_event_count; e++) {
            events += seen[place][e] != 0u;
        }
        pairs += events;
        printf("  %-24s %9llu  %llu\n", explore_place_name(place), (unsigned long long)states,
               (unsigned long long)events);
    }
    printf("  %llu of the pairs of a place and an event that can happen in it\n", (unsigned long long)pairs);
    explore_print_transitions();
    explore_print_rows();
    for (int n = 0; n < kinds; n++) {
        printf("  violated %llu times: %s\n", (unsigned long long)violations[n].times, violations[n].what);
    }
}

/* ---- breadth first ---- */

static void restore(uint32_t node)
{
    memcpy(explore_memory, memory[node], explore_bytes);
    explore_wrong = NULL;
}

/* The thread may wait for the slow loop to take the request before: then it comes. */
static void as_thread(void (*act)(int), int argument)
{
    if (explore_request_waits()) {
        hook_let_slow_loop_in();
    }
    act(argument);
    (void)hook_came();
}

static void apply(int event)
{
    as_thread(explore_events[event].act, explore_events[event].argument);
    explore_judge();
}

bool engine_may(int event, uint32_t groups)
{
    const struct explore_event *const e = &explore_events[event];
    return (e->groups & groups) != 0u && (e->may == NULL || e->may(e->argument));
}

/* Of each place the first state, and some that take much longer to reach. */
static void keep_example(uint32_t node, struct examples *x)
{
    int same = 0;
    uint32_t last = 0;
    for (int n = 0; n < x->count; n++) {
        if (nodes[x->node[n]].place == nodes[node].place) {
            same++;
            last = x->node[n];
        }
    }
    if (x->count < EXAMPLES_MOST && same < SAME_MOST && (same == 0 || node > 3u * last + 10u)) {
        x->node[x->count] = node;
        x->memory[x->count] = need(malloc(explore_bytes));
        memcpy(x->memory[x->count++], memory[node], explore_bytes);
    }
}

static void expand(uint32_t node, uint32_t groups, struct totals *t)
{
    for (int e = 0; e < explore_event_count; e++) {
        restore(node);
        if (!engine_may(e, groups)) {
            continue;
        }
        apply(e);
        t->transitions++;
        seen[nodes[node].place][e]++;
        if (explore_wrong != NULL) {
            violated(node, e, t);
        }
        (void)add(node, e);
    }
    restore(node);
    as_thread(explore_judge_off, 0);
    if (explore_wrong != NULL) {
        violated(node, -1, t);
    }
    free(memory[node]);
    memory[node] = NULL;
}

static void reset(void)
{
    nodes = nodes != NULL ? nodes : need(malloc(sizeof *nodes * NODES_MOST));
    memory = memory != NULL ? memory : need(malloc(sizeof *memory * NODES_MOST));
    slots = slots != NULL ? slots : need(malloc(sizeof *slots * SLOTS));
    memset(slots, 0xFF, sizeof *slots * SLOTS);
    memset(seen, 0, sizeof seen);
    count = 0;
    kinds = 0;
}

void engine_explore(int setup, uint64_t most, struct totals *totals, struct examples *examples)
{
    const struct explore_setup *const s = &explore_setups[setup];
    struct totals t = {0};
    reset();
    examples->count = 0;
    explore_begin(setup);
    uint32_t next = add(NONE, 0);
    for (; next < count && (most == 0u || next < most); next++) {
        keep_example(next, examples);
        expand(next, s->groups, &t);
    }
    t.states = next;
    printf("%s: %llu states, %llu transitions, %s; %llu violations of %d kinds\n", s->name,
           (unsigned long long)t.states, (unsigned long long)t.transitions,
           next == count ? "nothing new appears" : "CUT SHORT", (unsigned long long)t.violations, kinds);
    print_places();
    fflush(stdout);
    for (; next < count; next++) {
        free(memory[next]);
    }
    totals->states += t.states;
    totals->transitions += t.transitions;
    totals->violations += t.violations;
}

bool engine_play(int setup, char **names)
{
    explore_begin(setup);
    for (; *names != NULL; names++) {
        int event = 0;
        while (event < explore_event_count && strcmp(explore_events[event].name, *names) != 0) {
            event++;
        }
        if (event == explore_event_count) {
            fprintf(stderr, "explore: no event '%s'; tests/explore/events.c lists them\n", *names);
            return false;
        }
        explore_wrong = NULL;
        apply(event);
        printf("%-36s %-22s %s%s\n", *names, explore_place_name(explore_place()), explore_show(),
               explore_wrong != NULL ? explore_wrong : "");
    }
    return true;
}

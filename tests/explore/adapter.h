/* SPDX-License-Identifier: MIT */
/*
 * The drive as a transition system: all that the explorer knows of it. Names of the firmware stand in adapter.c and events.c
 * alone; the engine knows events by number, a state by its bytes, and what is wrong by a sentence.
 */
#ifndef TESTS_EXPLORE_ADAPTER_H
#define TESTS_EXPLORE_ADAPTER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define KEY_MOST 128

struct explore_setup {
    const char *name;
    uint32_t groups; /* of events, one bit each */
    bool sample;     /* small enough for `make test` */
};

struct explore_event {
    const char *name;
    const char *played; /* a scenario's console line for it, or = its event and arguments; NULL: none */
    uint32_t groups;
    void (*act)(int32_t argument);
    int32_t argument;
    bool (*may)(int32_t argument); /* NULL: always */
};

extern const struct explore_setup explore_setups[];
extern const int explore_setup_count;
extern const struct explore_event explore_events[];
extern const int explore_event_count;

/* The whole system, drive and surroundings, to be copied by the engine. */
extern void *const explore_memory;
extern const size_t explore_bytes;

/* The first state of a setup. */
void explore_begin(int setup);

/* The control state: enums and flags, timers only as none, running or due. Returns its length. */
size_t explore_key(uint8_t *key);

/* Looks at the state that an event has led to. explore_wrong: NULL, or what must not be. */
void explore_judge(void);

/* Only what the bus shows: the transition from what it showed before. */
void explore_judge_shown(void);
extern const char *explore_wrong;

/* The changes of the status word that were seen, and the rows of the state machine's table. */
void explore_print_transitions(void);
void explore_print_rows(void);

/* Whether `off` leads to rest from here, and leaves it there. Changes the state. */
void explore_judge_off(int unused);

/* A rough place in the state machine, for what is printed. */
int explore_place(void);
const char *explore_place_name(int place);
extern const int explore_place_count;
const char *explore_show(void); /* cause, gates and wish in a few words */

/* ---- for interleavings ---- */

/* The current loop's interrupt with this in its sample; false: there are no more kinds. */
bool explore_interrupt(int kind);
extern const char *const explore_interrupt_names[];

/* The slow loop's; false if it is held off now. */
bool explore_slow_loop(void);

/* The slow loop has not yet taken a request: the thread would wait for it. */
bool explore_request_waits(void);

/* A few milliseconds pass, each judged. */
void explore_settle(void);

/* What is interrupted: the slow loop, the thread, or a request. */
bool explore_is_slow_loop(int event);
bool explore_is_thread(int event);
bool explore_is_request(int event);

/* Whether the interrupts are held off at this block. */
bool explore_masks_all(void);
bool explore_masks_slow_loop(void);

/* Called at every block at which these two differ: notices gates that open without a wish. */
void explore_look(void);
extern const volatile uint32_t *const explore_watched[2];

#endif

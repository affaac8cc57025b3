/* SPDX-License-Identifier: MIT */
/*
 * The scope of one axis: up to eight signals, a capture of them at up to the current loop's rate, and the recorder of the last
 * milliseconds before a fault, which always runs.
 *
 * While a capture is under way the current loop's vector holds an entry of a few instructions (system/scoped_tick.S): it
 * counts the tick, raises the sampler's interrupt and goes on to the handler. The sampler is less urgent than the current loop
 * and more urgent than the slow loop, so it runs right after the handler and copies its results. When no capture is under way
 * the vector holds the handler itself, and the scope costs nothing.
 *
 * A tick during the copy is still counted: the sampler then drops its sample and runs again.
 */
#ifndef FIRMWARE_SCOPE_SCOPE_H
#define FIRMWARE_SCOPE_SCOPE_H

#include "firmware/drive/drive.h"
#include "firmware/scope/capture.h"
#include "firmware/scope/recorder.h"
#include "firmware/scope/signals.h"
#include "firmware/scope/sweep.h"
#include "firmware/settings/error.h"

#ifndef SCOPE_WORDS
#define SCOPE_WORDS (AXIS_COUNT == 1u ? 4096u : 768u) /* a second axis takes the room */
#endif
#define SCOPE_EVERY_MOST 40000u /* one sample a second, at 40 kHz */

/* For the entry: its assembly knows the members' offsets. */
struct scope_entry {
    uint32_t pend_bit; /* written to *pend, raises the sampler's interrupt */
    volatile uint32_t *pend;
    void (*handler)(void);   /* the current loop's, while the scope's entry is in the vector */
    volatile uint32_t ticks; /* samples of the current loop while it is there */
};

struct scope {
    struct scope_entry entry; /* first */
    void (*enter)(void);      /* system/scoped_tick.S */
    struct axis *axis;
    struct signal_choice choice;
    struct signal_source sources[SIGNALS_MOST];
    struct signal_source watched; /* what triggers, chosen or not */
    uint32_t trigger_on;          /* as in signal_choice */
    uint32_t ram, ram_end;        /* the addresses that may be read: neither stacks nor their guard */
    uint32_t every;               /* ticks between kept samples */
    uint32_t due;                 /* tick of the next one */
    uint32_t torn;                /* samples dropped because the next tick came while they were copied */
    uint32_t late;                /* samples kept later than they were due: the record has a gap */
    uint32_t rate_of;             /* ticks a millisecond, at its beginning */
    int32_t nothing;              /* 0 */
    struct sweep sweep;
    uint32_t swept; /* its last tick */
    struct capture capture;
    struct recorder recorder;
    int32_t memory[SCOPE_WORDS];
};

/* Initialises a zeroed structure: default signals, no trigger, no capture. The rest is the system's. Thread, once. */
void scope_init(struct scope *s, struct axis *a, void (*enter)(void), volatile uint32_t *pend, uint32_t pend_bit);

/* ---- settings: refused while a capture is under way. Each discards the last capture. Thread ---- */

enum error scope_choose(struct scope *s, const struct signal_choice *choice);
enum error scope_set_every(struct scope *s, uint32_t ticks);
enum error scope_set_before(struct scope *s, uint32_t samples); /* checked when it is armed: the signals decide */
enum error scope_set_trigger(struct scope *s, uint32_t signal, enum capture_when when, int32_t level);

/* Goes to another axis, with the same choice of signals; what was recorded of the one before is gone. */
enum error scope_attach(struct scope *s, struct axis *axis);

/* ---- a capture. Thread ---- */

/* Whether there is a signal, or a word that may be read. Any context. */
static inline bool scope_knows(const struct scope *s, uint32_t which)
{
    return which < signal_count || (which >= s->ram && which < s->ram_end && s->ram_end - which >= sizeof(int32_t));
}

/* Samples in a record of the present signals. Any context. */
static inline uint32_t scope_capacity(const struct scope *s)
{
    return SCOPE_WORDS / s->choice.count;
}

/* Starts; the previous record is lost. ERROR_SCOPE_BEFORE: value is the largest that works. */
struct outcome scope_arm(struct scope *s);

/* Triggers now. */
enum error scope_fire(struct scope *s);

/* Ends it; an unfinished record is lost. On return the vector holds the handler. */
void scope_off(struct scope *s);

/* Begins a sweep of a loop, with so many milliamperes. Thread. */
struct outcome scope_sweep(struct scope *s, enum sweep_loop loop, int32_t milliamp);

/* True if the scope's entry is in the vector. Any context. */
static inline bool scope_is_on(const struct scope *s)
{
    return s->axis->loop.diverted != NULL;
}

/* ---- reading: a plain function, for any protocol. Thread ---- */

enum scope_record {
    SCOPE_CAPTURE, /* the last finished capture */
    SCOPE_FAULT,   /* what the last fault left */
};

struct scope_extent {
    uint32_t samples; /* 0: there is none */
    uint32_t words;   /* signals */
    uint32_t trigger; /* the sample of the trigger, or of the fault */
    const struct signal_choice *choice;
};

struct scope_extent scope_extent(const struct scope *s, enum scope_record record);

/*
 * Copies up to `most` words of a record from its word `from` on, sample by sample, oldest first; word k of sample n is number
 * n * words + k. Returns how many it copied.
 */
uint32_t scope_read(const struct scope *s, enum scope_record record, uint32_t from, int32_t *to, uint32_t most);

/* ---- the interrupts' halves ---- */

/* A tick of the current loop has been served. The sampler's interrupt. */
void scope_sample(struct scope *s);

/* Stores the recorder's sample, and takes the entry out of the vector when nothing needs it. Slow loop, last. */
void scope_step(struct scope *s);

#endif

/* SPDX-License-Identifier: MIT */
/*
 * The scope of one axis: up to eight signals, a capture of them at up to the current loop's rate, and the recorder of the last
 * milliseconds before a fault, which always runs.
 *
 * During a capture the current loop's vector holds an entry of a few instructions (system/scoped_tick.S), which counts the
 * tick, raises the sampler's interrupt and jumps to the handler. The sampler's priority is below the current loop's and above
 * the slow loop's: it runs right after the handler and copies its results. Without a capture the vector holds the handler
 * itself, and the scope takes no time.
 *
 * A tick during the copy is still counted: the sampler then drops its sample and runs again.
 */
#ifndef FIRMWARE_SCOPE_SCOPE_H
#define FIRMWARE_SCOPE_SCOPE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/drive/drive.h"
#include "firmware/scope/signals.h"
#include "firmware/scope/sweep.h"
#include "firmware/settings/error.h"

/* ==== a capture ==== */

/*
 * A record around a trigger: samples fill a ring buffer until the trigger, then the post-trigger samples follow. Independent of
 * what the words mean.
 *
 * The trigger is checked at each stored sample. A signal triggers only when the pre-trigger samples are complete; a fault or a
 * command triggers immediately, with the samples there are, so neither is missed.
 */
enum capture_when {
    CAPTURE_NEVER, /* fault and command only */
    CAPTURE_ABOVE, /* a sample at the level or above */
    CAPTURE_BELOW, /* at the level or below */
    CAPTURE_RISES, /* rising edge: now at the level or above, before below */
    CAPTURE_FALLS, /* falling edge: now at the level or below, before above */
};

enum capture_state { CAPTURE_OFF, CAPTURE_WAITING, CAPTURE_TRIGGERED, CAPTURE_DONE };

enum capture_cause { CAPTURE_BY_NOTHING, CAPTURE_BY_SIGNAL, CAPTURE_BY_FAULT, CAPTURE_BY_COMMAND };

struct capture {
    /* settings */
    int32_t *memory;
    uint32_t words;   /* per sample, 1 or more */
    uint32_t samples; /* of the record, 1 or more; samples * words fit the memory */
    uint32_t before;  /* of these before the trigger, 0...samples - 1 */
    enum capture_when when;
    int32_t level;
    /* progress */
    volatile uint32_t state; /* enum capture_state */
    volatile bool fire;      /* the command */
    uint32_t cause;          /* enum capture_cause */
    uint32_t next;           /* position of the next sample in the memory */
    uint32_t filled;         /* samples stored, up to the record's length */
    uint32_t left;           /* samples to come after the trigger */
    uint32_t had_before;     /* samples there were before the trigger */
    int32_t last;            /* trigger signal in the previous sample */
    bool had_fault;
};

/* Starts with an empty memory. `fault`: one is latched already and does not trigger. The sampler must be idle. Thread. */
void capture_begin(struct capture *c, int32_t last, bool fault);

/* Where to write the next sample; capture_commit() then stores it. ISR. */
static inline __attribute__((always_inline)) int32_t *capture_slot(const struct capture *c)
{
    return c->memory + c->next * c->words;
}

static inline __attribute__((always_inline)) bool capture_signals(const struct capture *c, int32_t watched)
{
    const bool high = watched >= c->level;
    const bool low = watched <= c->level;
    switch (c->when) {
    case CAPTURE_ABOVE:
        return high;
    case CAPTURE_BELOW:
        return low;
    case CAPTURE_RISES:
        return high && c->last < c->level;
    case CAPTURE_FALLS:
        return low && c->last > c->level;
    default:
        return false;
    }
}

static inline __attribute__((always_inline)) uint32_t capture_cause(const struct capture *c, int32_t watched,
                                                                    bool fault)
{
    if (fault && !c->had_fault) {
        return CAPTURE_BY_FAULT;
    }
    if (c->fire) {
        return CAPTURE_BY_COMMAND;
    }
    return c->filled > c->before && capture_signals(c, watched) ? CAPTURE_BY_SIGNAL : CAPTURE_BY_NOTHING;
}

/* Stores the sample in the slot. `watched`: the trigger signal. Not when off or done. ISR. */
static inline __attribute__((always_inline)) void capture_commit(struct capture *c, int32_t watched, bool fault)
{
    const uint32_t next = c->next + 1u;
    c->next = next == c->samples ? 0u : next;
    c->filled += c->filled < c->samples ? 1u : 0u;
    if (c->state == CAPTURE_TRIGGERED) {
        c->left--;
    } else {
        const uint32_t cause = capture_cause(c, watched, fault);
        if (cause != CAPTURE_BY_NOTHING) {
            c->cause = cause;
            c->had_before = c->filled - 1u < c->before ? c->filled - 1u : c->before;
            c->left = c->samples - c->before - 1u;
            c->state = CAPTURE_TRIGGERED;
        }
    }
    c->last = watched;
    c->had_fault = fault;
    if (c->state == CAPTURE_TRIGGERED && c->left == 0u) {
        c->state = CAPTURE_DONE;
    }
}

/* Samples in a finished record, the trigger's included; 0 before that. Thread. */
uint32_t capture_samples(const struct capture *c);

/* A word of it; sample 0 is the oldest, sample had_before the one that triggered. Thread. */
int32_t capture_word(const struct capture *c, uint32_t sample, uint32_t word);

/* ==== the recorder ==== */

/*
 * Flight recorder: the slow loop stores the chosen signals once a millisecond, and a fault freezes them. Needs no arming, and
 * does not affect the current loop's interrupt.
 *
 * Two banks: one is written, the other holds the last fault's samples until the next fault. The one being written also serves
 * the continuous stream, by sample numbers.
 */
#define RECORDER_SAMPLES 64u

struct recorder_bank {
    uint32_t begun; /* number of its first sample */
    int32_t values[RECORDER_SAMPLES][SIGNALS_MAX];
};

struct recorder {
    struct recorder_bank bank[2];
    uint32_t writing;        /* the bank being written */
    volatile uint32_t count; /* total samples: the number of the next one */
    volatile uint32_t kept;  /* total faults recorded */
    uint32_t kept_end;   /* number after the last sample of the last fault, which is the first sample that shows it */
    uint32_t kept_fault; /* enum fault */
    struct signal_choice kept_of; /* signals */
    uint32_t had_fault;
};

/* The signals have changed: restarts the recording; the last fault's samples stay. Slow loop masked. Thread. */
void recorder_restart(struct recorder *r);

/* Another axis, with this enum fault: restarts, and drops the last fault's samples. Slow loop masked. Thread. */
void recorder_reset(struct recorder *r, uint32_t fault);

/*
 * Stores a sample; freezes the record if the fault is new. All values are of one current loop sample, unless conversions end
 * faster than they can be copied. Slow loop, once a millisecond, last.
 */
void recorder_step(struct recorder *r, const struct signal_choice *choice, const struct signal_source *sources,
                   const struct fabric *fabric, uint32_t fault);

/* Copies sample `number`. False if it has been overwritten, or is not there yet. Thread. */
bool recorder_get(const struct recorder *r, uint32_t number, uint32_t words, int32_t *values);

/* Samples of the last fault, oldest first; the last one was taken after the fault. Thread. */
uint32_t recorder_fault_samples(const struct recorder *r);
int32_t recorder_fault_word(const struct recorder *r, uint32_t sample, uint32_t word);

/* ==== the scope ==== */

#ifndef SCOPE_WORDS
#define SCOPE_WORDS (AXIS_COUNT == 1u ? 4096u : 768u) /* a second axis takes the room */
#endif
#define SCOPE_EVERY_MAX 40000u /* one sample a second, at 40 kHz */

/* For the entry in assembly, which uses the members' offsets. */
struct scope_entry {
    uint32_t pend_bit; /* raises the sampler's interrupt when written to *pend */
    volatile uint32_t *pend;
    void (*handler)(void);   /* the current loop's, while the scope's entry is in the vector */
    volatile uint32_t ticks; /* samples of the current loop meanwhile */
};

struct scope {
    struct scope_entry entry; /* first */
    void (*enter)(void);      /* system/scoped_tick.S */
    struct axis *axis;
    struct signal_choice choice;
    struct signal_source sources[SIGNALS_MAX];
    struct signal_source watched; /* the trigger signal, chosen or not */
    uint32_t trigger_on;          /* as in signal_choice */
    uint32_t ram, ram_end;        /* the addresses that may be read: neither stacks nor their guard */
    uint32_t every;               /* decimation: ticks per stored sample */
    uint32_t due;                 /* tick of the next one */
    uint32_t dropped;             /* samples dropped because the next tick came while they were copied */
    uint32_t late;                /* samples stored later than due: the record has a gap */
    uint32_t rate_of;             /* ticks a millisecond, when the capture began */
    int32_t zero;                 /* 0 */
    struct sweep sweep;
    uint32_t swept; /* its last tick */
    struct capture capture;
    struct recorder recorder;
    int32_t memory[SCOPE_WORDS];
};

/* Initialises a zeroed structure: default signals, no trigger, no capture. Thread, once. */
void scope_init(struct scope *s, struct axis *a, void (*enter)(void), volatile uint32_t *pend, uint32_t pend_bit);

/* ---- settings: refused during a capture. Each discards the last capture. Thread ---- */

enum error scope_choose(struct scope *s, const struct signal_choice *choice);
enum error scope_set_every(struct scope *s, uint32_t ticks);
enum error scope_set_before(struct scope *s,
                            uint32_t samples); /* checked when armed: the limit depends on the signals */
enum error scope_set_trigger(struct scope *s, uint32_t signal, enum capture_when when, int32_t level);

/* Attaches to another axis, with the same signals; the records of the previous axis are dropped. */
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

/* Starts; the previous record is lost. ERROR_SCOPE_BEFORE: the value is the largest possible. */
struct outcome scope_arm(struct scope *s);

/* Triggers now. */
enum error scope_fire(struct scope *s);

/* Stops; an unfinished record is lost. On return the vector holds the handler. */
void scope_off(struct scope *s);

/* Begins a frequency sweep of a loop, of this amplitude. Thread. */
struct outcome scope_sweep(struct scope *s, enum sweep_loop loop, int32_t milliamp);

/* True if the scope's entry is in the vector. Any context. */
static inline bool scope_is_on(const struct scope *s)
{
    return s->axis->loop.diverted != NULL;
}

/* ---- reading, for any protocol. Thread ---- */

enum scope_record {
    SCOPE_CAPTURE, /* the last finished capture */
    SCOPE_FAULT,   /* the recorder's, of the last fault */
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

/* After each tick of the current loop. The sampler's interrupt. */
void scope_sample(struct scope *s);

/* Stores the recorder's sample, and removes the entry from the vector when nothing needs it. Slow loop, last. */
void scope_step(struct scope *s);

#endif

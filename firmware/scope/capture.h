/* SPDX-License-Identifier: MIT */
/*
 * A record around a trigger: samples fill a ring until the trigger comes, then as many more follow as belong after it. Knows
 * words, not signals.
 *
 * The trigger is checked at each sample kept. A signal triggers once there are as many samples as belong before the trigger; a
 * fault or a command triggers at once, with what there is before it, so neither is ever missed.
 */
#ifndef FIRMWARE_SCOPE_CAPTURE_H
#define FIRMWARE_SCOPE_CAPTURE_H

#include <stdbool.h>
#include <stdint.h>

enum capture_when {
    CAPTURE_NEVER, /* fault and command only */
    CAPTURE_ABOVE, /* a sample at the level or above */
    CAPTURE_BELOW, /* at the level or below */
    CAPTURE_RISES, /* one at the level or above, the one before it below */
    CAPTURE_FALLS, /* one at the level or below, the one before it above */
};

enum capture_state { CAPTURE_OFF, CAPTURE_WAITING, CAPTURE_TRIGGERED, CAPTURE_DONE };

enum capture_cause { CAPTURE_BY_NOTHING, CAPTURE_BY_SIGNAL, CAPTURE_BY_FAULT, CAPTURE_BY_COMMAND };

struct capture {
    /* as it was begun */
    int32_t *memory;
    uint32_t words;   /* per sample, 1 or more */
    uint32_t samples; /* of the whole record, 1 or more; samples * words fit the memory */
    uint32_t before;  /* how many of these before the trigger, 0...samples - 1 */
    enum capture_when when;
    int32_t level;
    /* progress */
    volatile uint32_t state; /* enum capture_state */
    volatile bool fire;      /* the command */
    uint32_t cause;          /* enum capture_cause */
    uint32_t next;           /* sample's place in the memory */
    uint32_t filled;         /* samples since the beginning, up to the record's length */
    uint32_t left;           /* samples still to come */
    uint32_t had_before;     /* samples before the trigger */
    int32_t last;            /* trigger signal in the previous sample */
    bool had_fault;
};

/* Starts with an empty memory. `fault`: one is latched already and does not trigger. The sampler must be idle. Thread. */
void capture_begin(struct capture *c, int32_t last, bool fault);

/* Where the next sample goes; it counts only after capture_commit(). ISR. */
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

/* Commits the sample in the slot. `watched`: the trigger signal. Not when off or done. ISR. */
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

#endif

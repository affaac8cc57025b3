/* SPDX-License-Identifier: MIT */
/*
 * Always records the last samples before a fault: the slow loop stores the chosen signals once a millisecond, and a fault
 * freezes them. It needs no trigger or arming, and does not affect the current loop's interrupt.
 *
 * Two banks: one is written, the other holds the last fault's samples until the next fault. The written bank also serves a
 * continuous stream, by sample numbers.
 */
#ifndef FIRMWARE_SCOPE_RECORDER_H
#define FIRMWARE_SCOPE_RECORDER_H

#include "firmware/scope/signals.h"

#define RECORDER_SAMPLES 64u

struct recorder_bank {
    uint32_t begun; /* number of its first sample */
    int32_t values[RECORDER_SAMPLES][SIGNALS_MOST];
};

struct recorder {
    struct recorder_bank bank[2];
    uint32_t writing;        /* which is written */
    volatile uint32_t count; /* total samples: the number of the next one */
    volatile uint32_t kept;  /* total faults whose samples were kept */
    uint32_t kept_end;   /* one past the last sample's number of the last fault: that sample is the first to show it */
    uint32_t kept_fault; /* enum fault */
    struct signal_choice kept_of; /* signals */
    uint32_t had_fault;
};

/* The signals have changed: restarts the recording; what was kept stays. Slow loop held. Thread. */
void recorder_begin(struct recorder *r);

/* The axis is another one, which has this fault, enum fault: restarts, and drops what was kept. Slow loop held. Thread. */
void recorder_forget(struct recorder *r, uint32_t fault);

/*
 * Stores a sample; keeps the record if the fault is new. All values are from one sample of the current loop, unless
 * conversions end faster than they can be copied. Slow loop, once a millisecond, last.
 */
void recorder_step(struct recorder *r, const struct signal_choice *choice, const struct signal_source *sources,
                   const struct fabric *fabric, uint32_t fault);

/* Copies sample `number` of the present recording. False if it has been overwritten, or is yet to come. Thread. */
bool recorder_get(const struct recorder *r, uint32_t number, uint32_t words, int32_t *values);

/* Samples kept by the last fault, oldest first; the last was taken after the fault. Thread. */
uint32_t recorder_fault_samples(const struct recorder *r);
int32_t recorder_fault_word(const struct recorder *r, uint32_t sample, uint32_t word);

#endif

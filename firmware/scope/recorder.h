/* SPDX-License-Identifier: MIT */
/*
 * The last samples before a fault, always: the slow loop stores the chosen signals once a millisecond, and a fault keeps
 * what is there. It needs no trigger, nobody has to arm it, and the current loop's interrupt does not notice.
 *
 * Two banks: one is written, the other one holds the last fault's samples until the next fault. What is written serves a
 * continuous stream as well, by the samples' numbers.
 */
#ifndef FIRMWARE_SCOPE_RECORDER_H
#define FIRMWARE_SCOPE_RECORDER_H

#include "firmware/scope/signals.h"

#define RECORDER_SAMPLES 64u

struct recorder_bank {
    uint32_t begun; /* number of the first sample that it got */
    int32_t values[RECORDER_SAMPLES][SIGNALS_MOST];
};

struct recorder {
    struct recorder_bank bank[2];
    uint32_t writing;             /* which is written */
    volatile uint32_t count;      /* samples ever: the number of the next one */
    volatile uint32_t kept;       /* faults whose samples were kept, ever */
    uint32_t kept_end;            /* number behind the last sample of the last fault: the first that shows it */
    uint32_t kept_fault;          /* enum fault */
    struct signal_choice kept_of; /* signals */
    uint32_t had_fault;
};

/* From now on other signals: what is written begins anew; what was kept stays. Slow loop held back. Thread. */
void recorder_begin(struct recorder *r);

/*
 * Stores a sample; keeps what is there if the fault is new. All values are of one sample of the current loop, unless
 * conversions end quicker than they can be copied. Slow loop, once a millisecond, last.
 */
void recorder_step(struct recorder *r, const struct signal_choice *choice, const struct signal_source *sources,
                   const struct fabric *fabric, uint32_t fault);

/* Copies sample `number` of what is written. False if it has been overwritten, or is yet to come. Thread. */
bool recorder_get(const struct recorder *r, uint32_t number, uint32_t words, int32_t *values);

/* Samples that the last fault left, oldest first, the last of them taken when the fault was there already. Thread. */
uint32_t recorder_kept(const struct recorder *r);
int32_t recorder_kept_word(const struct recorder *r, uint32_t sample, uint32_t word);

#endif

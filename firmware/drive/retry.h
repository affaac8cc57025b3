/* SPDX-License-Identifier: MIT */
/*
 * Whether the drive may switch on by itself: after a fault that may pass, while retries are left, as long as the operator's
 * last word is "operate". All of it is the thread's; the slow loop reads `start_rpm_q16`.
 */
#ifndef FIRMWARE_DRIVE_RETRY_H
#define FIRMWARE_DRIVE_RETRY_H

#include <stdbool.h>
#include <stdint.h>

struct axis;

struct retry {
    bool wanted;         /* an accepted `on`, or all enable bits: off, quick stop, clear and a missing bit end it */
    bool waiting;        /* for the delay to pass */
    bool due;            /* cleared without a person: the drive switches on as soon as it can */
    uint32_t count;      /* since the last 10 s of good operation, or a person's `clear` */
    uint32_t latched_ms; /* when the fault was seen */
    uint32_t good_since_ms;
    bool resumes; /* towards the speed last asked for: */
    int32_t resume_rpm_q16;
    int32_t start_rpm_q16; /* operation begins with this target */
};

/* Nothing switches on by itself from here on, whatever it was waiting for. */
void retry_withdraw(struct retry *r);

/* A person has cleared the fault: the same, and the count starts over. */
void retry_forget(struct retry *r);

/* An `on` is accepted: by the operator, or by this. */
void retry_accept(struct retry *r);

/* Clears what may be cleared and switches on again when it is time. Thread, whenever it has time. */
void drive_retry(struct axis *a);

#endif

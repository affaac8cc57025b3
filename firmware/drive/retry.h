/* SPDX-License-Identifier: MIT */
/*
 * Automatic restart after a transient fault, while retries are left and the operator's last command was to operate. Written by
 * the thread only; the slow loop reads `start_rpm_q16`.
 */
#ifndef FIRMWARE_DRIVE_RETRY_H
#define FIRMWARE_DRIVE_RETRY_H

#include <stdbool.h>
#include <stdint.h>

struct axis;

struct retry {
    /* operation is commanded: set by an accepted `on` or all enable bits; reset by off, quick stop, clear or a missing bit */
    bool wanted;
    bool waiting;        /* for the delay to pass */
    bool due;            /* cleared automatically: the drive switches on as soon as possible */
    uint32_t count;      /* retries since the last 10 s of fault-free operation, or `clear` */
    uint32_t latched_ms; /* when the fault was seen */
    uint32_t good_since_ms;
    bool resumes; /* continues towards the last speed set-point: */
    int32_t resume_rpm_q16;
    int32_t start_rpm_q16; /* initial speed target of operation */
};

/* Cancels any automatic restart. */
void retry_withdraw(struct retry *r);

/* The operator has cleared the fault: the same, and resets the count. */
void retry_forget(struct retry *r);

/* An `on` was accepted, from the operator or a retry. */
void retry_accept(struct retry *r);

/* Clears the fault and switches on again after the delay. Thread, in its idle loop. */
void drive_retry(struct axis *a);

#endif

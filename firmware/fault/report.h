/* SPDX-License-Identifier: MIT */
/*
 * What the slow loop finds wrong. Modes, sources and monitors only report: they change nothing, and know no state and no
 * reaction. drive/reaction.h takes the reports in their order at the end of the same step.
 */
#ifndef FIRMWARE_FAULT_REPORT_H
#define FIRMWARE_FAULT_REPORT_H

#include "firmware/fault/fault.h"

#define FAULT_REPORTS_MOST 12u /* a step makes fewer: each monitor has its turns */
#define FAULT_WORDS        ((FAULT_COUNT + 31u) / 32u)

struct fault_report {
    enum fault cause;
    int32_t detail[2]; /* fault_record.detail */
};

struct fault_reports {
    uint32_t count;
    struct fault_report report[FAULT_REPORTS_MOST];
    volatile uint32_t warned[FAULT_WORDS]; /* one bit per fault that was only a warning, since `on` */
};

/* Slow loop. */
void fault_report(struct axis *a, enum fault cause, int32_t detail_0, int32_t detail_1);

/* Only warns, whatever reaction is chosen. Slow loop. */
void fault_warn(struct axis *a, enum fault cause);

/* Warns as long as it lasts, off or on. Slow loop, again and again. */
void fault_warn_while(struct axis *a, enum fault cause, bool lasts);

/* True if a fault was a warning since `on`. Any context. */
bool fault_warned(const struct fault_reports *r, enum fault cause);

/* Forgets the warnings. Slow loop, at `on`. */
void fault_forget_warnings(struct fault_reports *r);

#endif

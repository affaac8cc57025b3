/* SPDX-License-Identifier: MIT */
#include "firmware/fault/report.h"

#include "firmware/axis/axis.h"

void fault_report(struct axis *a, enum fault cause, int32_t detail_0, int32_t detail_1)
{
    struct fault_reports *const r = &a->reports;
    if (r->count < FAULT_REPORTS_MOST) {
        r->report[r->count] = (struct fault_report){cause, {detail_0, detail_1}};
        r->count++;
    }
}

void fault_warn(struct axis *a, enum fault cause)
{
    a->reports.warned[cause / 32u] |= 1u << (cause % 32u);
}

void fault_warn_while(struct axis *a, enum fault cause, bool lasts)
{
    if (lasts) {
        fault_warn(a, cause);
    } else {
        a->reports.warned[cause / 32u] &= ~(1u << (cause % 32u));
    }
}

bool fault_warned(const struct fault_reports *r, enum fault cause)
{
    return ((r->warned[cause / 32u] >> (cause % 32u)) & 1u) != 0u;
}

void fault_forget_warnings(struct fault_reports *r)
{
    for (uint32_t n = 0; n < FAULT_WORDS; n++) {
        r->warned[n] = 0;
    }
}

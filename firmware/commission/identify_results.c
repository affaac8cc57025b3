/* SPDX-License-Identifier: MIT */
#include "firmware/commission/identify_parts.h"

void identify_know(struct identify *d, enum identify_quantity what, int64_t value, int64_t interval)
{
    d->results[what] = (struct identify_result){
        .state = IDENTIFY_KNOWN, .value = (int32_t)value, .interval = (int32_t)(interval < 1 ? 1 : interval)};
}

void identify_know_exactly(struct identify *d, enum identify_quantity what, int32_t value)
{
    d->results[what] = (struct identify_result){.state = IDENTIFY_KNOWN, .value = value};
}

void identify_refuse(struct identify *d, enum identify_quantity what, enum identify_reason reason)
{
    d->results[what] = (struct identify_result){.state = IDENTIFY_REFUSED, .reason = reason};
}

void identify_refuse_rest(struct identify *d, enum identify_quantity first, enum identify_reason reason)
{
    for (size_t what = first; what < IDENTIFY_QUANTITIES; what++) {
        if (d->results[what].state == IDENTIFY_UNKNOWN) {
            identify_refuse(d, (enum identify_quantity)what, reason);
        }
    }
}

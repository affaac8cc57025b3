/* SPDX-License-Identifier: MIT */
#include "firmware/operate/identify_text.h"

#include "firmware/axis/fault.h"
#include "firmware/operate/messages.h"

#define RESULT_OF(NAME, ...)   [IDENTIFY_##NAME] = {__VA_ARGS__},
#define REFUSAL_OF(NAME, text) [IDENTIFY_##NAME] = text,

static const struct {
    const char *name, *unit;
    int32_t milli; /* thousandths of the unit in one of the result's */
} quantities[IDENTIFY_QUANTITIES] = {IDENTIFY_RESULTS(RESULT_OF)};

static const char *const reasons[IDENTIFY_REASONS] = {"", IDENTIFY_REFUSALS(REFUSAL_OF)};

static void put_result(struct text *out, uint32_t what, const struct identify_result *r)
{
    text_put(out, quantities[what].name);
    text_put(out, ": ");
    if (r->state == IDENTIFY_KNOWN && r->interval == 0) {
        text_put_int(out, r->value);
        text_put_line(out, ", exactly");
    } else if (r->state == IDENTIFY_KNOWN) {
        text_put_milli(out, r->value * quantities[what].milli);
        text_put(out, " +-");
        text_put_milli(out, r->interval * quantities[what].milli);
        text_put_line(out, quantities[what].unit);
    } else if (r->state == IDENTIFY_REFUSED) {
        text_put(out, "refused: ");
        text_put_line(out, r->reason < IDENTIFY_REASONS ? reasons[r->reason] : "unknown");
    } else {
        text_put_line(out, "not measured yet");
    }
}

static void put_end(struct text *out, const struct identify *d)
{
    if (d->step == IDENTIFY_STEP_NONE) {
        text_put_line(out, "identify has not run");
    } else if (!d->running && d->fault != FAULT_NONE) {
        text_put(out, "ended in step '");
        text_put(out, identify_step_name(d->stopped_in));
        text_put(out, "' by a fault: ");
        text_put_line(out, message_of_fault((enum fault)d->fault));
    } else if (!d->running && d->stopped_in != IDENTIFY_STEP_DONE) {
        text_put(out, "ended in step '");
        text_put(out, identify_step_name(d->stopped_in));
        text_put_line(out, "'");
    }
}

void identify_text_show(struct text *out, const struct identify *d)
{
    put_end(out, d);
    for (uint32_t what = 0; what < IDENTIFY_QUANTITIES && d->step != IDENTIFY_STEP_NONE; what++) {
        put_result(out, what, &d->results[what]);
    }
    if (d->step != IDENTIFY_STEP_NONE) {
        text_put(out, "time: ");
        text_put_milli(out, (int32_t)d->total_ms);
        text_put_line(out, " s");
    }
}

void identify_text_running(struct text *out, const struct identify *d)
{
    if (d->running) {
        text_put(out, "identify: step '");
        text_put(out, identify_step_name(d->step));
        text_put_line(out, "'");
    }
}

void identify_text_used(struct text *out, int32_t changed)
{
    text_put_int(out, changed);
    text_put_line(out, " parameters changed; 'get all' lists them, 'on' takes them");
}

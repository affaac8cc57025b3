/* SPDX-License-Identifier: MIT */
/* Measuring the motor, what was found, and learning cogging and the Hall switches. */
#include "firmware/operate/commands.h"
#include "firmware/operate/messages.h"

#define RESULT_OF(NAME, ...)   [IDENTIFY_##NAME] = {__VA_ARGS__},
#define REFUSAL_OF(NAME, text) [IDENTIFY_##NAME] = text,

static const struct {
    const char *name, *unit;
    int32_t milli; /* thousandths of the unit in one of the result's */
} identify_quantities[IDENTIFY_QUANTITIES] = {IDENTIFY_RESULTS(RESULT_OF)};

static const char *const identify_reasons[IDENTIFY_REASONS] = {"", IDENTIFY_REFUSALS(REFUSAL_OF)};

static void put_result(struct text *out, uint32_t what, const struct identify_result *r)
{
    const int32_t milli = identify_quantities[what].milli;
    text_print(out, "%s: ", identify_quantities[what].name);
    if (r->state == IDENTIFY_KNOWN && r->interval == 0) {
        text_print(out, "%d, exactly\n", r->value);
    } else if (r->state == IDENTIFY_KNOWN) {
        text_print(out, "%.3d +-%.3d%s\n", r->value * milli, r->interval * milli, identify_quantities[what].unit);
    } else if (r->state == IDENTIFY_REFUSED) {
        text_print(out, "refused: %s\n", r->reason < IDENTIFY_REASONS ? identify_reasons[r->reason] : "unknown");
    } else {
        text_put(out, "not measured yet\n");
    }
}

/* How it ended, then a line for each quantity: value, interval and unit, or why there is none. */
static void put_results(struct text *out, const struct identify *d)
{
    if (d->step == IDENTIFY_STEP_NONE) {
        text_put(out, "identify has not run\n");
        return;
    }
    if (!d->running && d->fault != FAULT_NONE) {
        text_print(out, "ended in step '%s' by a fault: %s\n", identify_step_name(d->stopped_in),
                   message_of_fault((enum fault)d->fault));
    } else if (!d->running && d->stopped_in != IDENTIFY_STEP_DONE) {
        text_print(out, "ended in step '%s'\n", identify_step_name(d->stopped_in));
    }
    for (uint32_t what = 0; what < IDENTIFY_QUANTITIES; what++) {
        put_result(out, what, &d->results[what]);
    }
    text_print(out, "time: %.3d s\n", (int32_t)d->total_ms);
}

void identify_print_step(struct text *out, const struct identify *d)
{
    if (d->running) {
        text_print(out, "identify: step '%s'\n", identify_step_name(d->step));
    }
}

static void run_identify_results(struct session *s, const struct arguments *a)
{
    if (a->value[1] == 0) {
        put_results(&s->out, &s->axis->identify);
        return;
    }
    const struct outcome outcome = drive_identify_use(s->axis);
    answer(s, outcome);
    if (outcome.error == ERROR_NONE) {
        text_print(&s->out, "%d parameters changed; 'get all' lists them, 'on' takes them\n", outcome.value);
    }
}

/* clang-format off */
const struct command commands_identify[] = {
    {"identify", "", "measure the motor, then off; needs the inverter's ratings and i_rated_ma only",
     .request = drive_identify, .begins = PROGRESS_IDENTIFY},
    {"identify", " show|use", "what it found, with intervals; or make parameters of what is known",
     {ARGUMENT_CHOICE}, .run = run_identify_results},
};
/* clang-format on */

static void run_learn(struct session *s, const struct arguments *a)
{
    answer(s, a->value[1] == 0 ? drive_learn_cogging(s->axis) : drive_learn_hall(s->axis));
}

/* clang-format off */
const struct command commands_learn[] = {
    {"learn", " cogging|hall",
     "turn slowly both ways and record cogging torque against position; or, while off, the edges of the Hall switches",
     {ARGUMENT_CHOICE}, .run = run_learn, .begins = PROGRESS_LEARN},
};
/* clang-format on */

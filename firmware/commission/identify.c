/* SPDX-License-Identifier: MIT */
#include "firmware/commission/identify.h"

#include "drivers/cortex/cpu.h"
#include "firmware/commission/identify_parts.h"
#include "firmware/commission/wiring.h"
#include "firmware/settings/config.h"
#include "firmware/settings/features.h"

/* ---- the script ---- */

/* linker/bounds/frames.py reads its columns. */
struct row {
    const char *name;
    bool (*measure)(struct identify *d, const struct measure_io *io);
    enum identify_reason (*evaluate)(struct identify *d);
    uint8_t needs; /* enum identify_needs */
    uint8_t from;  /* enum identify_quantity: the first that it finds */
};

#define ROW_OF(NAME, name, text, need, first, last) \
    [IDENTIFY_STEP_## \
        NAME] = {text, identify_measure_##name, identify_evaluate_##name, IDENTIFY_NEEDS_##need, IDENTIFY_##first},

static const struct row identify_script[IDENTIFY_STEPS] = {
    [IDENTIFY_STEP_NONE] = {.name = "none"}, IDENTIFY_SCRIPT(ROW_OF)[IDENTIFY_STEP_DONE] = {.name = "done"}};

const char *identify_step_name(uint32_t step)
{
    return step < IDENTIFY_STEPS ? identify_script[step].name : "unknown";
}

/* Whether this step has anything left to find. */
static bool is_open(const struct identify *d)
{
    const struct row *const row = &identify_script[d->step];
    return row->needs != IDENTIFY_NEEDS_OPEN || d->results[row->from].state == IDENTIFY_UNKNOWN;
}

/* ---- measuring ---- */

/* True if a current is regulated, false if voltages are held. */
static bool regulates(const struct identify *d)
{
    const uint32_t needs = identify_script[d->step].needs;
    return needs != IDENTIFY_NEEDS_VOLTAGE && !(needs == IDENTIFY_NEEDS_GRIP && d->reluctant);
}

/*
 * A rotor on a constant current oscillates almost undamped. So q is neither regulated nor has it a voltage: the EMF drives a
 * current through the winding's resistance, which damps.
 */
static void damp_q(volatile struct current_loop *c)
{
    current_loop_hold_q(c, 0);
    current_loop_set_i_q(c, 0);
}

static void hold_zero(const struct identify *d, volatile struct current_loop *c)
{
    current_loop_set_currents(c, 0, 0);
    if (!d->taken) {
        current_loop_hold(c, 0, 0);
    }
}

bool identify_measure(struct identify *d, const struct measure_io *io)
{
    d->ms++;
    d->phase_ms++;
    if (d->ms == 1u) {
        d->open = is_open(d);
        speed_loop_reset(io->speed, 0);
    }
    return identify_script[d->step].measure(d, io);
}

bool identify_step(struct identify *d, const struct measure_io *io)
{
    d->total_ms++;
    d->counts += io->speed->estimate.moved;
    if (d->step == IDENTIFY_STEP_DONE) {
        return true;
    }
    if (d->evaluating || d->pausing) {
        d->pausing = d->evaluating || d->total_ms % IDENTIFY_PACE_MS != 0u;
    } else {
        if (!d->taken) {
            damp_q(io->loop);
        }
        d->evaluating = d->pausing = identify_measure(d, io);
    }
    if (d->pausing) {
        hold_zero(d, io->loop);
    }
    return false;
}

/* ---- the tuning in force ---- */

bool identify_in_rotor_frame(const struct identify *d)
{
    return d->taken;
}

const struct tuning *identify_tuning(const struct identify *d)
{
    return d->evaluating || d->pausing || !regulates(d) ? &wiring_tuning : &d->tuning;
}

bool identify_takes_over(const struct identify *d)
{
    return d->retuned && !d->evaluating && !d->pausing;
}

uint32_t identify_angle_q32(const struct identify *d, const volatile struct current_loop *c)
{
    return d->taken ? current_loop_angle_q32(c) - d->ahead_q32 : d->start_q32;
}

void identify_taken(struct identify *d)
{
    d->retuned = false;
    d->taken = true;
    d->ahead_q32 = 0;
    d->counts = 0;
}

void identify_leave(struct identify *d)
{
    d->taken = false;
}

/* ---- evaluation ---- */

static enum identify_reason evaluate(struct identify *d)
{
    const enum identify_reason end = is_open(d) ? identify_script[d->step].evaluate(d) : IDENTIFY_NO_REASON;
    const bool turns = identify_script[d->step + 1u].needs >= IDENTIFY_NEEDS_ENCODER;
    return end == IDENTIFY_NO_REASON && turns && !source_has((uint32_t)d->nominal.angle_source, SOURCE_COUNTS)
               ? IDENTIFY_NO_ENCODER
               : end;
}

void identify_evaluate(struct identify *d)
{
    if (!d->running || !d->evaluating) {
        d->evaluating = d->evaluating && d->running; /* stopped before it began */
        return;
    }
    const enum identify_reason end = evaluate(d);
    if (end != IDENTIFY_NO_REASON) {
        identify_refuse_rest(d, end);
    }
    d->work = (union identify_work){0};
    const uint32_t mask = cpu_irq_save(); /* the slow loop may have stopped it meanwhile */
    const bool stopped = !d->running;
    if (!stopped) {
        d->ms = d->phase = d->phase_ms = 0;
        d->stopped_in = end == IDENTIFY_NO_REASON ? d->step + 1u : d->step;
        d->step = end == IDENTIFY_NO_REASON ? d->step + 1u : IDENTIFY_STEP_DONE;
    }
    d->evaluating = false;
    cpu_irq_restore(mask);
    if (stopped) {
        identify_refuse_rest(d, IDENTIFY_STOPPED);
    }
}

/* ---- begin and end ---- */

struct outcome identify_begin(struct identify *d, const struct params *p)
{
    const struct params nominal = *p;
    *d = (struct identify){.params = nominal, .nominal = nominal};
    identify_reset_motor(&d->params);
    d->params.current_bw_hz = 100;
    const struct outcome outcome = tuning_compute(&d->params, &d->tuning);
    if (identify_tune(d, 100) != IDENTIFY_NO_REASON) {
        return outcome;
    }
    d->i_rated_q15 = tuning_q15_from_milli(d->params.i_max_ma, nominal.i_range_ma);
    d->step = IDENTIFY_STEP_PULSES;
    d->stopped_in = IDENTIFY_STEP_PULSES;
    d->running = true;
    return OUTCOME_OK;
}

void identify_stop(struct identify *d, uint32_t fault)
{
    if (!d->running) {
        return;
    }
    d->running = false;
    d->fault = fault;
    identify_refuse_rest(d, IDENTIFY_STOPPED);
}

/* SPDX-License-Identifier: MIT */
#include "firmware/commission/identify.h"

#include <stddef.h>

#include "drivers/cortex/cpu.h"
#include "firmware/commission/identify_parts.h"
#include "firmware/commission/wiring.h"
#include "firmware/settings/scale.h"
#include "lib/q15.h"

#define CROSS_MOST_PM 249 /* as cross_pm takes it */

/* ---- steps ---- */

bool identify_in_rotor_frame(const struct identify *d)
{
    return d->taken;
}

static bool turns(uint32_t step)
{
    return step >= IDENTIFY_STEP_TURN;
}

static bool maps(uint32_t step)
{
    return step >= IDENTIFY_STEP_ALONG;
}

static bool measure_standing(struct identify *d, volatile struct current_loop *c, const struct adc_regs *adc)
{
    switch (d->step) {
    case IDENTIFY_STEP_PULSES:
        return identify_measure_pulses(d, c, adc);
    case IDENTIFY_STEP_HOLD:
        return identify_measure_hold(d, c);
    case IDENTIFY_STEP_RESISTANCE:
        return identify_measure_resistance(d, c);
    case IDENTIFY_STEP_AXES:
        return identify_measure_axes(d, c, adc);
    case IDENTIFY_STEP_INDUCTANCE:
    default:
        return identify_measure_inductance(d, c, adc);
    }
}

static bool measure_turning(struct identify *d, const struct identify_io *io)
{
    switch (d->step) {
    case IDENTIFY_STEP_TURN:
        return identify_measure_turn(d, io);
    case IDENTIFY_STEP_PUSH:
        return identify_measure_push(d, io);
    case IDENTIFY_STEP_INDEX:
        return identify_measure_index(d, io);
    case IDENTIFY_STEP_RAMPS:
        return identify_measure_ramps(d, io);
    case IDENTIFY_STEP_SPEEDS:
    default:
        return identify_measure_speeds(d, io);
    }
}

static bool think_standing(struct identify *d)
{
    switch (d->step) {
    case IDENTIFY_STEP_PULSES:
        return identify_think_pulses(d);
    case IDENTIFY_STEP_HOLD:
        return identify_think_hold(d);
    case IDENTIFY_STEP_RESISTANCE:
        return identify_think_resistance(d);
    case IDENTIFY_STEP_AXES:
        return identify_think_axes(d);
    case IDENTIFY_STEP_INDUCTANCE:
    default:
        return identify_think_inductance(d);
    }
}

static bool think_turning(struct identify *d)
{
    switch (d->step) {
    case IDENTIFY_STEP_TURN:
        return identify_think_turn(d);
    case IDENTIFY_STEP_PUSH:
        return identify_think_push(d);
    case IDENTIFY_STEP_INDEX:
        return identify_think_index(d);
    case IDENTIFY_STEP_RAMPS:
        return identify_think_ramps(d);
    case IDENTIFY_STEP_SPEEDS:
    default:
        return identify_think_speeds(d);
    }
}

/* Whether the next step can begin. */
static bool think(struct identify *d)
{
    if (maps(d->step)) {
        return identify_think_map(d);
    }
    return turns(d->step) ? think_turning(d) : think_standing(d);
}

static bool measure(struct identify *d, const struct identify_io *io)
{
    if (maps(d->step)) {
        return identify_measure_map(d, io);
    }
    return turns(d->step) ? measure_turning(d, io) : measure_standing(d, io->loop, &io->fabric->adc);
}

/* True if a current is regulated, false if voltages are held. */
static bool regulates(const struct identify *d)
{
    return d->step != IDENTIFY_STEP_PULSES && !(d->step == IDENTIFY_STEP_RESISTANCE && d->reluctant);
}

static void hold_nothing(const struct identify *d, volatile struct current_loop *c)
{
    c->i_d_ref_q15 = 0;
    c->i_q_ref_q15 = 0;
    if (!d->taken) {
        c->integral_d_q9 = 0;
        c->integral_q_q9 = 0;
    }
}

/*
 * A rotor on a steady current swings like an undamped pendulum. So across the field no current is regulated and no voltage
 * held: the swing's EMF drives a current through the winding's resistance there, and that brakes.
 */
static void calm(volatile struct current_loop *c)
{
    c->integral_q_q9 = 0;
    c->i_q_ref_q15 = 0;
}

bool identify_step(struct identify *d, const struct identify_io *io)
{
    d->total_ms++;
    d->counts += io->speed->estimate.moved;
    if (d->step == IDENTIFY_STEP_DONE) {
        return true;
    }
    if (!d->thinking) {
        d->ms++;
        if (!d->taken) {
            calm(io->loop);
        }
        d->thinking = measure(d, io);
    }
    if (d->thinking) {
        hold_nothing(d, io->loop);
    }
    return false;
}

/* ---- the tuning in force ---- */

const struct tuning *identify_tuning(const struct identify *d)
{
    return d->thinking || !regulates(d) ? &wiring_tuning : &d->tuning;
}

bool identify_takes_over(const struct identify *d)
{
    return d->retuned && !d->thinking;
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

void identify_think(struct identify *d)
{
    if (!d->running || !d->thinking) {
        return;
    }
    const bool on = think(d);
    const uint32_t mask = cpu_irq_save(); /* the slow loop may have stopped it meanwhile, and that stays */
    const bool stopped = !d->running;
    if (!stopped) {
        d->ms = 0;
        d->stopped_in = on ? d->step + 1u : d->step;
        d->step = on ? d->step + 1u : IDENTIFY_STEP_DONE;
        d->thinking = false;
    }
    cpu_irq_restore(mask);
    if (stopped) {
        identify_refuse_rest(d, (enum identify_quantity)0, IDENTIFY_STOPPED);
    }
}

void identify_stop(struct identify *d, uint32_t fault)
{
    if (!d->running) {
        return;
    }
    d->running = false;
    d->fault = fault;
    identify_refuse_rest(d, (enum identify_quantity)0, IDENTIFY_STOPPED);
}

/* ---- beginning ---- */

struct outcome identify_begin(struct identify *d, const struct params *p)
{
    const struct params told = *p;
    *d = (struct identify){.params = told, .told = told};
    identify_forget_motor(&d->params);
    d->params.current_bw_hz = 100;
    const struct outcome outcome = tuning_compute(&d->params, &d->tuning);
    if (!identify_tune(d, 100)) {
        return outcome;
    }
    d->i_rated_q15 = tuning_q15_from_milli(d->params.i_max_ma, told.i_range_ma);
    d->step = IDENTIFY_STEP_PULSES;
    d->stopped_in = IDENTIFY_STEP_PULSES;
    d->running = true;
    return OUTCOME_OK;
}

/* ---- results ---- */

static uint32_t take(const struct identify *d, enum identify_quantity what, int32_t *param, int32_t units)
{
    const struct identify_result *const r = &d->results[what];
    if (r->state != IDENTIFY_KNOWN) {
        return 0;
    }
    const int32_t rounded = (r->value + units / 2) / units;
    const int32_t value = rounded < 1 ? 1 : rounded;
    const uint32_t changed = *param != value ? 1u : 0u;
    *param = value;
    return changed;
}

static uint32_t put(int32_t *param, int64_t value)
{
    const uint32_t changed = *param != value ? 1u : 0u;
    *param = (int32_t)value;
    return changed;
}

static bool is_known(const struct identify *d, enum identify_quantity what)
{
    return d->results[what].state == IDENTIFY_KNOWN;
}

/* Flux by current is an inductance: 0.1 uWb by mA are 1e2 uH. */
static int64_t apparent_uh(int64_t flux_e1_uwb, int64_t i_ma)
{
    const int64_t uh = flux_e1_uwb > 0 && i_ma > 0 ? scale(flux_e1_uwb, 100, i_ma) : 1;
    return uh < 1 ? 1 : uh;
}

/* Of current in d the part that it takes from the magnets' flux, or adds to it; reckoned with that which is used. */
static uint32_t use_torque(const struct identify *d, struct params *p)
{
    if (!is_known(d, IDENTIFY_TORQUE_ACROSS) || !is_known(d, IDENTIFY_TORQUE_FLUX) || !is_known(d, IDENTIFY_FLUX)) {
        return 0;
    }
    const int64_t i_d_ma = d->results[IDENTIFY_TORQUE_ID].value;
    const int64_t more_e1_uwb = (int64_t)d->results[IDENTIFY_TORQUE_FLUX].value - d->results[IDENTIFY_FLUX].value;
    const int64_t sign = i_d_ma < 0 ? -1 : 1;
    return put(&p->ld_apparent_uh, apparent_uh(sign * more_e1_uwb, sign * i_d_ma)) +
           put(&p->lq_apparent_uh,
               apparent_uh(d->results[IDENTIFY_TORQUE_ACROSS].value, d->results[IDENTIFY_TORQUE_IQ].value)) +
           put(&p->cross_pm, q15_clamp(d->results[IDENTIFY_CROSS].value, -CROSS_MOST_PM, CROSS_MOST_PM));
}

/* Where reluctance outweighs the magnets the loops go by what the rated current leaves, and by that without one. */
static uint32_t use_inductances(const struct identify *d, struct params *p)
{
    if (!d->reluctant || !is_known(d, IDENTIFY_LD_Q3) || !is_known(d, IDENTIFY_LQ_Q3)) {
        return take(d, IDENTIFY_LD, &p->ld_uh, 1000) + take(d, IDENTIFY_LQ, &p->lq_uh, 1000);
    }
    return take(d, IDENTIFY_LD_Q3, &p->ld_uh, 1000) + take(d, IDENTIFY_LQ_Q3, &p->lq_uh, 1000) +
           take(d, IDENTIFY_LQ, &p->lq_rest_uh, 1000);
}

uint32_t identify_use(const struct identify *d, struct params *p)
{
    return use_inductances(d, p) + use_torque(d, p) + take(d, IDENTIFY_RESISTANCE, &p->resistance_mohm, 1000) +
           take(d, IDENTIFY_POLE_PAIRS, &p->pole_pairs, 1) + take(d, IDENTIFY_COUNTS, &p->encoder_counts, 1) +
           take(d, IDENTIFY_FLUX, &p->flux_uwb, 10) + take(d, IDENTIFY_INERTIA, &p->inertia_gmm2, 1) +
           take(d, IDENTIFY_COULOMB, &p->friction_unm, 1);
}

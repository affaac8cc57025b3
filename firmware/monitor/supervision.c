/* SPDX-License-Identifier: MIT */
#include "firmware/monitor/supervision.h"

#include "firmware/axis/axis.h"
#include "firmware/source/rotor.h"
#include "lib/q15.h"

#define TURNS      4u /* milliseconds until each part has had its turn */
#define SLOW_TURN  3u
#define LIMITED_MS 100u

void supervision_begin_again(struct axis *a)
{
    lock_watch_begin(&a->lock_watch);
    field_watch_reset(&a->field_watch);
    phase_watch_begin(a);
    zero_watch_begin(&a->supervision.zeros);
    speed_watch_begin(a);
    a->supervision.limited_ms = 0;
}

void supervision_begin(struct axis *a)
{
    encoder_watch_begin(a);
    supervision_begin_again(a);
}

static void watch_overspeed(struct axis *a)
{
    if (q15_abs(current_loop_w_q15(&a->loop)) > a->tuning.overspeed_w_q15) {
        fault_report(a, FAULT_OVERSPEED, axis_forward(a) * a->speed.speed_rpm_q4 / 16, 0);
    }
}

/* The modulator is at its limit, and the current is off by a tenth of i_max. */
static bool voltage_is_short(const struct axis *a)
{
    const volatile struct current_loop *const c = &a->loop;
    const int32_t radius_q15 = c->radius_q15 - (c->radius_q15 >> 5);
    if (c->v_d_q15 * c->v_d_q15 + c->v_q_q15 * c->v_q_q15 <= radius_q15 * radius_q15) {
        return false;
    }
    const int32_t missing_q15 = q15_abs(c->i_q_ref_q15 - c->i_q_q15) + q15_abs(c->i_d_ref_q15 - c->i_d_q15);
    return missing_q15 > a->tuning.i_max_q15 / 10;
}

static void watch_voltage(struct axis *a)
{
    uint32_t *const limited_ms = &a->supervision.limited_ms;
    if (voltage_is_short(a)) {
        *limited_ms += TURNS;
    } else if (*limited_ms != 0u) {
        *limited_ms -= TURNS;
    }
    if (*limited_ms >= LIMITED_MS) {
        fault_report(a, FAULT_VOLTAGE_LIMIT, 0, 0);
        *limited_ms = 0;
    }
}

static void watch_temperature(struct axis *a)
{
    if (thermal_winding_too_hot(&a->thermal)) {
        fault_report(a, FAULT_OVERTEMPERATURE, a->thermal.winding_q4 / 16, 0);
    }
    if (thermal_inverter_too_hot(&a->thermal)) {
        fault_report(a, FAULT_INVERTER_OVERLOAD, 0, 0);
    }
}

bool supervision_is_silent(const struct axis *a)
{
    const int32_t limit_ms = a->params.command_timeout_ms;
    return limit_ms != 0 && a->time_ms - a->command_ms > (uint32_t)limit_ms;
}

static void watch_commands(struct axis *a)
{
    if (supervision_is_silent(a)) {
        fault_report(a, FAULT_COMMAND_TIMEOUT, a->params.command_timeout_ms, 0);
    }
    if (a->master_lost != 0u) {
        fault_report(a, FAULT_MASTER_LOST, (int32_t)a->master_lost, 0);
    }
}

/* It moves no motor, but without it nobody stops one. Two axes have one thread, whose clock is the first one's: -1, too. */
static void watch_thread(struct axis *a)
{
    const int32_t away_ms = (int32_t)(a->time_ms - a->thread_ms);
    if (away_ms > CONFIG_THREAD_MS && a->thread_ms != 0u) {
        fault_report(a, FAULT_THREAD_STOPPED, away_ms, 0);
    }
}

/* False if the measured speed is in doubt, or the bridge may be off: nothing else is believed then. */
static bool rotor_is_sound(struct axis *a, uint32_t turn)
{
    return rotor_has_encoder(a) ? encoder_watch_step(a, turn) : lock_watch_step(a);
}

/* The parts take turns, to spread the load: phases and speed every second millisecond, what is slow every fourth. */
static void step_running(struct axis *a, uint32_t turn)
{
    if (!rotor_is_sound(a, turn)) {
        return;
    }
    watch_overspeed(a);
    speed_watch_side(a);
    zero_watch_step(&a->supervision.zeros, a);
    if (turn % 2u == 0u) {
        phase_watch_expect(a);
        speed_watch_step(a);
        return;
    }
    phase_watch_step(a);
    if (turn == SLOW_TURN) {
        watch_voltage(a);
        watch_temperature(a);
        watch_commands(a);
    }
}

/* Nothing, or, in the bursts of identify, what flows on the mean but not in a sample. */
static bool asks_no_phase(const struct axis *a)
{
    const volatile struct current_loop *const c = &a->loop;
    const bool bursts = a->identify.running && (c->kp_d_q9 == 0 || c->kp_q_q9 == 0);
    return bursts || (c->i_d_ref_q15 == 0 && c->i_q_ref_q15 == 0);
}

/*
 * Whatever asks for a current before operation, with an encoder, without, or to identify: a phase without its share is open
 * there, too. Where nothing is asked, as in the wiring test, nothing is missed. Whoever wanted the start must still be there.
 */
static void watch_start(struct axis *a, uint32_t turn)
{
    watch_overspeed(a);
    if (turn == SLOW_TURN) {
        watch_commands(a);
    }
    if (asks_no_phase(a)) {
        phase_watch_begin(a);
    } else if (turn % 2u == 0u) {
        phase_watch_expect(a);
    } else {
        phase_watch_step(a);
    }
}

void supervision_step(struct axis *a)
{
    if (a->state == AXIS_OPERATION_ENABLED || a->state == AXIS_QUICK_STOP) {
        step_running(a, a->time_ms % TURNS);
    } else if (a->state == AXIS_SWITCHED_ON) {
        watch_start(a, a->time_ms % TURNS);
    } else {
        return;
    }
    watch_thread(a);
}

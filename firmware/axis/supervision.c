/* SPDX-License-Identifier: MIT */
#include "firmware/axis/supervision.h"

#include "firmware/axis/axis.h"
#include "firmware/axis/rotor.h"
#include "lib/q15.h"

void supervision_begin(struct axis *a)
{
    supervise_encoder_begin(a);
    supervise_phases_begin(a);
    supervise_speed_begin(a);
}

static void watch_overspeed(struct axis *a)
{
    if (q15_abs(current_loop_w_q15(&a->loop)) > a->tuning.overspeed_w_q15) {
        axis_report(a, FAULT_OVERSPEED, a->speed.speed_rpm_q4 / 16, 0);
    }
}

static void watch_temperature(struct axis *a)
{
    if (thermal_winding_too_hot(&a->thermal)) {
        axis_report(a, FAULT_OVERTEMPERATURE, a->thermal.winding_q4 / 16, 0);
    }
    if (thermal_inverter_too_hot(&a->thermal)) {
        axis_report(a, FAULT_INVERTER_OVERLOAD, 0, 0);
    }
}

static void watch_commands(struct axis *a)
{
    const int32_t limit_ms = a->params.command_timeout_ms;
    if (limit_ms != 0 && a->time_ms - a->command_ms > (uint32_t)limit_ms) {
        axis_report(a, FAULT_COMMAND_TIMEOUT, limit_ms, 0);
    }
}

/* What is to be seen of the encoder in each millisecond. Returns by how much the count is not where it should be. */
static inline int32_t look_at_encoder(struct axis *a)
{
    struct encoder_watch *const e = &a->supervision.encoder;
    const struct speed_estimate *const seen = &a->speed.estimate;
    const int32_t speed_q32 = e->speed_q32;
    if (seen->moved != 0) {
        e->still_ms = 0;
        e->speed_moving_q32 = e->speed_before_q32;
    } else {
        e->still_ms++;
    }
    e->speed_before_q32 = speed_q32;
    e->speed_q32 = a->loop.pll.speed_q32;
    return supervise_encoder_surprise_q32(&a->tuning, seen->moved, seen->step_clocks, speed_q32);
}

/* Whether that is not as it is nearly always. */
static inline bool strange(const struct encoder_watch *e, int32_t surprise_q32)
{
    return e->doubt_ms != 0u || q15_abs(surprise_q32) > e->jump_limit_q32;
}

/* Together with the torque limits (axis.c). The references of now are what the currents follow until the phases are looked at. */
static void step_even(struct axis *a)
{
    a->supervision.phases.i_d_ref_q15 = a->loop.i_d_ref_q15;
    a->supervision.phases.i_q_ref_q15 = a->loop.i_q_ref_q15;
    supervise_speed(a);
}

static void step_odd(struct axis *a, uint32_t turn)
{
    supervise_phases(a);
    if (turn == 3u) {
        supervise_voltage(a);
        watch_temperature(a);
        watch_commands(a);
    }
}

/* False while it is in doubt: then its speed is, too. */
static inline bool encoder_is_sound(struct axis *a, uint32_t turn)
{
    const int32_t surprise_q32 = look_at_encoder(a);
    if (turn % 2u != 0u || strange(&a->supervision.encoder, surprise_q32)) {
        supervise_encoder(a, surprise_q32, turn);
        return a->supervision.encoder.doubt_ms == 0u;
    }
    return true;
}

/*
 * Each part in its turn, so that no millisecond has much more to do than another: phases and speed every second one, what is
 * slow every fourth.
 */
static void step_running(struct axis *a, uint32_t turn)
{
    if (!rotor_has_encoder(a)) {
        sensorless_supervise(a);
    } else if (!encoder_is_sound(a, turn)) {
        return;
    }
    watch_overspeed(a);
    if (turn % 2u != 0u) {
        step_odd(a, turn);
    } else {
        step_even(a);
    }
}

void supervision_step(struct axis *a)
{
    const uint32_t state = a->state;
    if (state == AXIS_OPERATION_ENABLED || state == AXIS_QUICK_STOP) {
        step_running(a, a->time_ms % SUPERVISION_TURNS);
    } else if (state == AXIS_SWITCHED_ON) {
        watch_overspeed(a);
    }
}

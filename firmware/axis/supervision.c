/* SPDX-License-Identifier: MIT */
#include "firmware/axis/supervision.h"

#include "firmware/axis/axis.h"
#include "lib/q15.h"

void supervision_begin(struct axis *a)
{
    supervise_encoder_begin(a);
    supervise_phases_begin(a);
    supervise_speed_begin(a);
}

/* While the encoder is in doubt its speed is, too. */
static void watch_overspeed(struct axis *a)
{
    if (a->supervision.encoder.doubt_ms == 0u && q15_abs(current_loop_w_q15(&a->loop)) > a->tuning.overspeed_w_q15) {
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

/*
 * Each part in its turn, so that no millisecond has much more to do than another: phases and speed every second one, what is
 * slow every fourth. The torque limits (axis.c) fall together with the phases.
 */
static void step_running(struct axis *a, uint32_t turn)
{
    supervise_encoder(a, turn);
    if (a->supervision.encoder.doubt_ms != 0u) {
        return;
    }
    if (turn % 2u == 0u) {
        supervise_phases(a);
        return;
    }
    supervise_speed(a);
    supervise_phases_remember(a);
    if (turn == 3u) {
        supervise_voltage(a);
        watch_temperature(a);
        watch_commands(a);
    }
}

void supervision_step(struct axis *a)
{
    const uint32_t turn = a->time_ms % SUPERVISION_TURNS;
    const uint32_t state = a->state;
    if (turn == 0u) {
        thermal_step(&a->thermal, &a->loop, adc_temperature_code(&a->fabric->adc));
    }
    if (state == AXIS_OPERATION_ENABLED || state == AXIS_QUICK_STOP) {
        step_running(a, turn);
    }
    if (state >= AXIS_SWITCHED_ON && state <= AXIS_QUICK_STOP) {
        watch_overspeed(a);
    }
}

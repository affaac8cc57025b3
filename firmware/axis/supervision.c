/* SPDX-License-Identifier: MIT */
#include "firmware/axis/supervision.h"

#include "firmware/axis/axis.h"
#include "firmware/axis/supervision_step.h"
#include "lib/q15.h"

void supervision_begin(struct axis *a)
{
    supervise_encoder_begin(a);
    supervise_phases_begin(a);
    supervise_speed_begin(a);
}

void supervise_temperature(struct axis *a)
{
    if (thermal_winding_too_hot(&a->thermal)) {
        axis_report(a, FAULT_OVERTEMPERATURE, a->thermal.winding_q4 / 16, 0);
    }
    if (thermal_inverter_too_hot(&a->thermal)) {
        axis_report(a, FAULT_INVERTER_OVERLOAD, 0, 0);
    }
}

void supervise_commands(struct axis *a)
{
    const int32_t limit_ms = a->params.command_timeout_ms;
    if (a->time_ms - a->command_ms > (uint32_t)limit_ms) {
        axis_report(a, FAULT_COMMAND_TIMEOUT, limit_ms, 0);
    }
}

void supervision_step(struct axis *a)
{
    supervision_step_here(a, a->state, rotor_has_encoder(a), current_loop_w_q15(&a->loop));
}

/* SPDX-License-Identifier: MIT */
/* The drive before its slow loop runs. Thread. */
#include <stddef.h>

#include "drivers/fabric/reset.h"
#include "firmware/drive/drive.h"
#include "firmware/drive/states.h"
#include "firmware/settings/config.h"

void drive_init(struct axis *a, struct fabric *fabric)
{
    *a = (struct axis){.fabric = fabric, .fabric_doubt = AXIS_FABRIC_DOUBTED};
    current_loop_init(&a->loop);
    speed_loop_init(&a->speed);
    params_init(&a->params);
    (void)tuning_compute(&a->params, &a->tuning); /* the initial values fit: a test says so */
    current_loop_tune(&a->loop, &a->tuning);
    thermal_init(&a->thermal, NULL, &a->params);
    reaction_init(&a->reactions);
    speed_loop_tune(&a->speed, &a->tuning);
}

void drive_remember_heat(struct axis *a, struct thermal_memory *memory)
{
    thermal_init(&a->thermal, memory, &a->params);
}

void drive_join(struct axis *a, struct axis *follower)
{
    a->beside = follower;
    follower->beside = a;
    follower->carrier_ahead_counts = CONFIG_HALF_COUNTS / 2u;
}

static struct pwm_setup pwm_setup(const struct axis *a)
{
    return (struct pwm_setup){
        .half_counts = CONFIG_HALF_COUNTS,
        .dead_counts = CONFIG_DEAD_COUNTS,
        .min_pulse_counts = CONFIG_MIN_PULSE_COUNTS,
        .update = PWM_UPDATE_VALLEY,
        .ahead_counts = a->carrier_ahead_counts,
    };
}

/* A warm start finds what a cold one does, even where the fabric was not reset with the core: a debugger's start. */
static bool start_fabric(struct axis *a)
{
    fabric_reset(a->fabric);
    (void)encoder_init(&a->fabric->encoder, (uint32_t)a->params.encoder_counts, false);
    const struct pwm_setup setup = pwm_setup(a);
    const bool running = pwm_init(&a->fabric->pwm, &setup);
    adc_start(&a->fabric->adc);
    return gate_start_watch(&a->fabric->gate, CONFIG_WATCH_CLOCKS) && running;
}

/* The fabric's state is unknown: it is not touched from here on. Its gates have been off since the reset. */
static void doubt_fabric(struct axis *a, enum fault cause)
{
    a->fabric_doubt = AXIS_FABRIC_DOUBTED;
    fault_raise(a, cause);
    (void)states_take(a, DRIVE_EVENT_DOUBTED);
}

void drive_start(struct axis *a, enum fault boot_fault)
{
    if (fault_doubts_fabric(boot_fault)) {
        doubt_fabric(a, boot_fault);
        return;
    }
    if (!start_fabric(a)) {
        doubt_fabric(a, FAULT_FABRIC);
        return;
    }
    a->fabric_doubt = 0;
    (void)states_take(a, DRIVE_EVENT_BOOTED);
    if (boot_fault != FAULT_NONE) {
        fault_raise(a, boot_fault);
    }
}

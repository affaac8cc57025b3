/* SPDX-License-Identifier: MIT */
#include "drivers/cortex/cpu.h"
#include "firmware/axis/axis.h"
#include "firmware/commission/pulses.h"
#include "firmware/control/bridge.h"
#include "firmware/drive/start.h"
#include "firmware/source/rotor.h"

#define FILTER_STEPS 20u /* 3.2 us: a sixth of a degree at 150 Hz, and longer than a PWM edge couples into the wires */
#define PLAYED       3u  /* samples from setting the integrals to the PWM output */
#define TURNS_COUNTS 2   /* sectors since the start began: the rotor turns, so the wiring cannot be tested */

void start_filter_hall(struct axis *a)
{
    encoder_filter_hall(&a->fabric->encoder, FILTER_STEPS);
}

static bool select_hall(struct axis *a, uint32_t follows)
{
    volatile struct current_loop *const c = &a->loop;
    current_loop_field(c, 0, 0);
    if (!current_loop_select(c, a->fabric, LOOP_HALL)) {
        fault_raise(a, FAULT_FABRIC); /* the gate does not let go */
        return false;
    }
    current_loop_count_from_rotor(c, follows);
    return true;
}

void start_hall_begin(struct axis *a)
{
    start_filter_hall(a);
    current_loop_offset(&a->loop, 0);
    if (select_hall(a, UINT32_MAX)) {
        hall_begin(&a->hall, &a->loop, &a->fabric->encoder);
        rotor_take_speed(a);
    }
}

/* Sectors since the start began. */
static int32_t start_hall_moved(const struct axis *a)
{
    const int32_t moved = (int32_t)((const volatile struct hall *)&a->hall)->count;
    return moved < 0 ? -moved : moved;
}

/* The gates switch on right after a sample, when the PWM already outputs the EMF: no current step with a turning rotor. */
static void hall_start_lead(struct axis *a)
{
    current_loop_off(&a->loop, a->fabric);
    if (!select_hall(a, UINT32_MAX)) {
        return;
    }
    current_loop_arm(&a->loop, a->fabric, &a->tuning);
    emf_pulse_wait(a->fabric, PLAYED);
    (void)bridge_enable(&a->loop, a->fabric); /* if refused, the next step finds the fault */
    hall_watch_begin(a);
    a->start.phase = START_HALL;
}

static void look_at_wiring(struct axis *a)
{
    start_follow(a, LOOP_HALL);
    wiring_start(&a->start.wiring, false);
    a->start.phase = START_WIRING;
}

void start_hall(struct axis *a)
{
    const uint32_t state = encoder_hall_latched(&a->fabric->encoder);
    if (a->start.learns) {
        look_at_wiring(a);
    } else if (!hall_state_is_valid(&a->hall, state)) {
        fault_raise_with(a, FAULT_HALL_INVALID, (int32_t)state, 0);
    } else if ((a->start.wired && !a->start.recheck_wiring) || start_hall_moved(a) >= TURNS_COUNTS) {
        hall_start_lead(a);
    } else {
        look_at_wiring(a);
    }
}

void start_hall_wired(struct axis *a)
{
    a->start.wired = true;
    if (!FEATURE_IN(LEARN) || !a->start.learns) {
        hall_start_lead(a);
        return;
    }
    start_follow(a, LOOP_HALL);
    sensorless_begin(a);
    a->start.phase = START_ALIGN_HALL;
}

static bool step_hall_alignment(struct axis *a)
{
    if (sensorless_align(a)) {
        hall_learn_begin(&a->hall_learn);
        a->start.phase = START_LEARN_HALL;
    }
    return false;
}

static bool step_hall_learning(struct axis *a)
{
    struct hall_learn *const l = &a->hall_learn;
    switch (hall_learn_step(l, &a->loop, &a->fabric->encoder, &a->tuning)) {
    case HALL_LEARN_DONE:
        hall_table_to_params(&l->found, &a->params);
        return true;
    case HALL_LEARN_BLOCKED:
        fault_raise_with(a, FAULT_HALL_UNKNOWN, 0, hall_learn_states(l));
        return false;
    case HALL_LEARN_UNCLEAR:
        fault_raise_with(a, FAULT_HALL_UNKNOWN, (int32_t)(l->edges / (2u * HALL_LEARN_TURNS)), hall_learn_states(l));
        return false;
    case HALL_LEARN_LOAD:
        fault_raise_with(a, FAULT_LOAD_TOO_HIGH, l->detail_deg < 0 ? -l->detail_deg : l->detail_deg, 0);
        return false;
    case HALL_LEARN_RUNNING:
    default:
        return false;
    }
}

/* Test currents rarely turn a rotor by more than a sector. */
static bool hall_driven(const struct axis *a)
{
    return start_hall_moved(a) > 2;
}

static bool hall_holds_voltage(const struct axis *a)
{
    return a->start.phase == START_ALIGN_HALL;
}

static bool start_hall_step(struct axis *a)
{
    switch (a->start.phase) {
    case START_ALIGN_HALL:
        return FEATURE_IN(LEARN) && step_hall_alignment(a);
    case START_LEARN_HALL:
        return FEATURE_IN(LEARN) && step_hall_learning(a);
    case START_HALL:
    default:
        return true;
    }
}

const struct start_source start_by_hall = {.before = rotor_take_speed,
                                           .begin = start_hall_begin,
                                           .calibrated = start_hall,
                                           .wired = start_hall_wired,
                                           .driven = hall_driven,
                                           .step = start_hall_step,
                                           .holds_voltage = hall_holds_voltage};

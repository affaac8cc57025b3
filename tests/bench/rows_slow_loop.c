/* SPDX-License-Identifier: MIT */
#include <stddef.h>

#include "drivers/board.h"
#include "drivers/cortex/nvic.h"
#include "firmware/settings/config.h"
#include "firmware/system/handlers.h"
#include "tests/bench/loop_state.h"
#include "tests/bench/print.h"
#include "tests/bench/rows.h"
#include "tests/bench/vectors.h"

#define RPM_Q16  65536
#define EXTREMES 512u

static uint32_t found; /* faults */

static const struct torque_view view = {.speed_rpm_q4 = 1000 * 16, .i_limit_q15 = INT32_MAX, .limit_speed = true};

TIMING_FUNCTION(time_measure, speed_loop_measure(&axes[0].speed, &axes[0].fabric->encoder, &axes[0].tuning))
TIMING_FUNCTION(time_watch, torque_measure(&axes[0].torque, &axes[0].loop, &axes[0].tuning, 16000))
TIMING_FUNCTION(time_limits, torque_set_limits(&axes[0].torque, &axes[0].tuning, &view))
TIMING_FUNCTION(time_ask, torque_ask(&axes[0].torque, &axes[0].loop, &axes[0].tuning, axes[0].torque_command_q15))
TIMING_FUNCTION(time_step,
                (void)speed_loop_step(&axes[0].speed, &axes[0].tuning, axes[0].tuning.ramp_q16, &axes[0].torque.limits))
TIMING_FUNCTION(time_profile, profile_step(&axes[0].motion.profile, &axes[0].tuning.profile))
TIMING_FUNCTION(time_cogging,
                (void)cogging_torque_q15(&axes[0].motion.cogging, &axes[0].speed.estimate, &axes[0].tuning))
TIMING_FUNCTION(time_follow, current_loop_follow(&axes[0].loop, axes[0].fabric, &axes[0].tuning))
TIMING_FUNCTION(time_thermal, thermal_step(&axes[0].thermal, &axes[0].loop, 0u))
TIMING_FUNCTION(time_encoder, (void)encoder_watch_step(&axes[0], 1u))
TIMING_FUNCTION(time_phases, phase_watch_step(&axes[0]))
TIMING_FUNCTION(time_deviation, speed_watch_step(&axes[0]))
TIMING_FUNCTION(time_index, start_learn_index(&axes[0]))
TIMING_FUNCTION(time_drive_step, drive_step(&axes[0]))

static uint32_t interrupting(void)
{
    return rows_time_interrupt(BOARD_IRQ_TICK);
}

/* What the encoder shows has come since the last step: so many counts, in so many of its clocks; or nothing has. */
static void set_encoder(int32_t rpm_q4, uint32_t clocks)
{
    const struct encoder_regs *const encoder = &axes[0].fabric->encoder;
    struct speed_estimate *const e = &axes[0].speed.estimate;
    const int32_t counts = rpm_q4 * axes[0].tuning.encoder_counts / (60 * 16 * 1000);
    e->speed_rpm_q15 = rpm_q4 * (1 << 11);
    e->count = encoder_latched(encoder) - (uint32_t)counts;
    e->clock = encoder_edge_clock(encoder) - (counts != 0 ? clocks : 0u);
    e->interval_clocks = clocks;
    e->lost = false;
    e->moved = counts;
    e->latch_clock = encoder_latch_clock(encoder) - CONFIG_PWM_COUNTS * CONFIG_PERIODS_PER_SLOW;
    axes[0].motion.turns = (struct turns){.counts = 1000000, .count = e->count};
}

/* On its way at some speed, to somewhere near or far: it is pushed, holds its speed or brakes. */
static void set_profile(void)
{
    struct motion *const m = &axes[0].motion;
    const struct tuning *const t = &axes[0].tuning;
    const int64_t here = position_of_counts(m->turns.counts + axes[0].speed.estimate.moved, t);
    profile_begin(&m->profile, &t->profile, here, vector_random(-t->profile.v_max, t->profile.v_max));
    profile_aim(&m->profile, here + (int64_t)vector_random(-(1 << 30), 1 << 30) * (1 << vector_random(0, 8)));
    position_begin(&m->position, m->profile.position, m->profile.speed);
}

/* The bridge is on as of now: the fabric gives the next step's proof of life 3.5 ms. */
static void enable_bridge(void)
{
    struct gate_regs *const gate = &axes[0].fabric->gate;
    gate_disable(gate);
    (void)gate_clear(gate, GATE_STATUS_LATCHES);
    (void)gate_enable(gate);
}

/* A drive in operation at any speed, and what drive_step(&axes[0]) looks at besides. */
static void set_state(int32_t speed_q32, int32_t ref_rpm, int32_t target_rpm, int32_t integral_q29)
{
    loop_state_typical(&axes[0].loop);
    axes[0].loop.pll.speed_q32 = speed_q32;
    axes[0].loop.radius_q15 = vector_random(4000, 17000);
    axes[0].speed.speed_rpm_q4 = tuning_rpm_q15(&axes[0].tuning, speed_q32) >> 11;
    axes[0].torque.energy_q25 = axes[0].tuning.bus_set_energy_q25 / 2;
    axes[0].torque.burn_q15 = 0;
    axes[0].torque_command_q15 = vector_random(-20000, 20000);
    axes[0].speed.ref_rpm_q16 = ref_rpm * RPM_Q16;
    axes[0].speed.target_rpm_q16 = target_rpm * RPM_Q16;
    axes[0].speed.integral_q29 = integral_q29;
    axes[0].tuning.overspeed_w_q15 = Q15_ONE;
    axes[0].state = AXIS_OPERATION_ENABLED;
    axes[0].faults.cause = FAULT_NONE;
    axes[0].heartbeat = adc_sequence(&axes[0].fabric->adc) - CONFIG_PERIODS_PER_SLOW; /* else it would be a fault */
    supervision_begin(&axes[0]);
    set_encoder(axes[0].speed.speed_rpm_q4, (uint32_t)vector_random(90000, 110000));
    set_profile();
    enable_bridge();
}

/* The voltages that go with the speed: the EMF. Else the flux would be near its limit at any speed. */
static void set_voltages(void)
{
    struct current_loop *const c = &axes[0].loop;
    const int32_t emf_q15 = (current_loop_w_q15(c) * axes[0].tuning.emf_q12) >> 12;
    const int32_t q_steps = emf_q15 * (CONFIG_BUS_STEPS / 4) / (adc_vbus_q15(&axes[0].fabric->adc) / 4);
    c->v_d_steps = 0;
    c->v_q_steps = q15_clamp(q_steps, -CONFIG_RADIUS_STEPS, CONFIG_RADIUS_STEPS);
    c->v_d_q15 = 0; /* reckoned from these in the step */
    c->v_q_q15 = emf_q15;
    flux_limit_reset(&axes[0].torque.flux);
}

static void set_typical(void)
{
    const int32_t speed_q32 = vector_random(-(1 << 26), 1 << 26); /* below over-speed */
    const int32_t rpm = (tuning_rpm_q15(&axes[0].tuning, speed_q32) >> 11) / 16;
    set_state(speed_q32, rpm + vector_random(-50, 50), vector_random(-4000, 4000), vector_random(-8192, 8192) * 16384);
    set_voltages();
}

static void set_extreme(uint32_t index)
{
    static const int32_t speeds_q32[] = {0, 1, -1, (1 << 28) - 1, (1 << 13) - (1 << 28), 1 << 15, -(1 << 15), 1 << 24};
    static const int32_t rpms[] = {0, 1, -1, 20000, -20000, 300, -300, 4000};
    set_state(speeds_q32[index & 7u], rpms[(index >> 3) & 7u], rpms[(index >> 6) & 7u],
              vector_random(-32768, 32767) * 16384);
    axes[0].torque.energy_q25 = axes[0].tuning.bus_set_energy_q25; /* braking is limited, and burns */
    axes[0].torque.burn_q15 = vector_random(1, axes[0].tuning.burn_max_q15);
}

/* A step that finds a fault is another step, and not one of those that count. */
static void count_fault(void)
{
    found += axes[0].faults.cause != FAULT_NONE ? 1u : 0u;
}

static void print_states(const char *name, timer_function timer, uint32_t (*interrupt)(void))
{
    vector_restart();
    timing_begin(&rows_timing);
    for (uint32_t i = 0; i < TIMING_TYPICAL; i++) {
        set_typical();
        timing_add_typical(&rows_timing, interrupt != NULL ? interrupt() : timing_once(timer, NULL, NULL));
        count_fault();
    }
    for (uint32_t i = 0; i < EXTREMES; i++) {
        set_extreme(i);
        timing_add_extreme(&rows_timing, interrupt != NULL ? interrupt() : timing_once(timer, NULL, NULL));
        count_fault();
    }
    rows_print(name);
}

void rows_build_tables(void)
{
    struct torque_builder builder;
    torque_build_begin(&builder, &axes[0].torque, &axes[0].params, &axes[0].tuning, 16384);
    while (torque_build_step(&builder, &axes[0].torque, &axes[0].params, &axes[0].tuning)) {
    }
}

void rows_slow_loop(void)
{
    print_heading("slow loop, in operation: its parts, the step of the state machine, the whole interrupt");
    found = 0;
    rows_build_tables();
    axes[0].fabric->pwm.CONTROL = 0u; /* at rest: no leg turns on */
    axes[0].loop.status_max = GATE_STATUS_LIVE;
    nvic_enable(BOARD_IRQ_TICK);
    axes[0].mode = AXIS_MODE_SPEED;
    print_states("speed_loop_measure", time_measure, NULL);
    print_states("torque_measure", time_watch, NULL);
    print_states("torque_set_limits", time_limits, NULL);
    print_states("torque_ask", time_ask, NULL);
    print_states("speed_loop_step", time_step, NULL);
    print_states("current_loop_follow", time_follow, NULL);
    print_states("thermal_step", time_thermal, NULL);
    print_states("encoder_watch_step", time_encoder, NULL);
    print_states("phase_watch_step", time_phases, NULL);
    print_states("speed_watch_step", time_deviation, NULL);
    print_states("start_learn_index", time_index, NULL);
    print_states("drive_step.speed", time_drive_step, NULL);
    axes[0].mode = AXIS_MODE_TORQUE;
    print_states("drive_step.torque", time_drive_step, NULL);
    axes[0].mode = AXIS_MODE_POSITION;
    axes[0].motion.cogging.count = COGGING_HARMONICS;
    axes[0].motion.cogging.full_rpm_q4 = INT32_MAX; /* at any speed */
    print_states("profile_step", time_profile, NULL);
    print_states("cogging_torque_q15.8", time_cogging, NULL);
    print_states("drive_step.position", time_drive_step, NULL);
    axes[0].motion.cogging.count = 0;
    axes[0].mode = AXIS_MODE_SPEED;
    print_states("slow_loop.pended", NULL, interrupting);
    nvic_disable(BOARD_IRQ_TICK);
    gate_disable(&axes[0].fabric->gate);
    axes[0].fabric->pwm.CONTROL = PWM_CONTROL_RUN;
    axes[0].loop.status_max = UINT32_MAX;
    print_note("faults found", found);
    axes[0].state = AXIS_SWITCH_ON_DISABLED;
    axes[0].faults.cause = FAULT_NONE;
}

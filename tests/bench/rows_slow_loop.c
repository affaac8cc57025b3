/* SPDX-License-Identifier: MIT */
#include <stddef.h>

#include "drivers/board.h"
#include "drivers/cortex/nvic.h"
#include "firmware/settings/config.h"
#include "firmware/system/axes.h"
#include "tests/bench/loop_state.h"
#include "tests/bench/print.h"
#include "tests/bench/rows.h"
#include "tests/bench/vectors.h"

#define RPM_Q4_LIMIT (20000 * 16)
#define RPM_Q16      65536
#define EXTREMES     512u

TIMING_FUNCTION(time_measure, speed_loop_measure(&axes[0].speed, &axes[0].loop, &axes[0].tuning))
TIMING_FUNCTION(time_limit, (void)speed_loop_current_limit(&axes[0].loop, &axes[0].tuning))
TIMING_FUNCTION(time_step, (void)speed_loop_step(&axes[0].speed, &axes[0].tuning, axes[0].tuning.ramp_q16,
                                                 axes[0].tuning.i_max_q15))
TIMING_FUNCTION(time_drive_step, axis_step(&axes[0]))

static uint32_t interrupting(void)
{
    return rows_time_interrupt(BOARD_IRQ_TICK);
}

/* A drive in operation at any speed, and what axis_step(&axes[0]) looks at besides. */
static void set_state(int32_t speed_q32, int32_t ref_rpm, int32_t target_rpm, int64_t integral_q16)
{
    loop_state_typical(&axes[0].loop);
    axes[0].loop.pll.speed_q32 = speed_q32;
    axes[0].loop.radius_q15 = vector_random(4000, 17000);
    speed_loop_measure(&axes[0].speed, &axes[0].loop, &axes[0].tuning);
    axes[0].speed.ref_rpm_q16 = ref_rpm * RPM_Q16;
    axes[0].speed.target_rpm_q16 = target_rpm * RPM_Q16;
    axes[0].speed.integral_q16 = integral_q16;
    axes[0].state = AXIS_OPERATION_ENABLED;
    axes[0].faults.cause = FAULT_NONE;
    axes[0].heartbeat = adc_sequence(&axes[0].fabric->adc) - CONFIG_LOOPS_PER_SLOW; /* else it would be a fault */
    supervision_begin(&axes[0]);
}

static void set_typical(void)
{
    const int32_t speed_q32 = vector_random(-(1 << 26), 1 << 26); /* below over-speed */
    const int32_t rpm = tuning_rpm_q4(&axes[0].tuning, speed_q32) / 16;
    set_state(speed_q32, rpm + vector_random(-50, 50), vector_random(-4000, 4000),
              (int64_t)vector_random(-8192, 8192) * 65536);
}

static void set_extreme(uint32_t index)
{
    static const int32_t speeds_q32[] = {0, 1, -1, (1 << 28) - 1, -(1 << 28), 1 << 15, -(1 << 15), 1 << 24};
    static const int32_t rpms[] = {0, 1, -1, 20000, -20000, 300, -300, 4000};
    set_state(speeds_q32[index & 7u], rpms[(index >> 3) & 7u], rpms[(index >> 6) & 7u],
              (int64_t)vector_random(-32768, 32767) * 65536);
}

static void print_states(const char *name, timer_function timer, uint32_t (*interrupt)(void))
{
    vector_restart();
    timing_begin(&rows_timing);
    for (uint32_t i = 0; i < TIMING_TYPICAL; i++) {
        set_typical();
        timing_add_typical(&rows_timing, interrupt != NULL ? interrupt() : timing_once(timer, NULL, NULL));
    }
    for (uint32_t i = 0; i < EXTREMES; i++) {
        set_extreme(i);
        timing_add_extreme(&rows_timing, interrupt != NULL ? interrupt() : timing_once(timer, NULL, NULL));
    }
    const struct timing_figures figures = timing_figures(&rows_timing);
    print_row(name, &figures, NULL);
}

void rows_slow_loop(void)
{
    print_heading("slow loop, in operation: its parts, the step of the state machine, the whole interrupt");
    nvic_enable(BOARD_IRQ_TICK);
    axes[0].mode = AXIS_MODE_SPEED;
    print_states("speed_loop_measure", time_measure, NULL);
    print_states("speed_loop_current_limit", time_limit, NULL);
    print_states("speed_loop_step", time_step, NULL);
    print_states("drive_step.speed", time_drive_step, NULL);
    axes[0].mode = AXIS_MODE_TORQUE;
    print_states("drive_step.torque", time_drive_step, NULL);
    axes[0].mode = AXIS_MODE_SPEED;
    print_states("slow_loop.pended", NULL, interrupting);
    nvic_disable(BOARD_IRQ_TICK);
    axes[0].state = AXIS_SWITCH_ON_DISABLED;
    axes[0].faults.cause = FAULT_NONE;
}

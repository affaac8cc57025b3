/* SPDX-License-Identifier: MIT */
#include <stddef.h>

#include "drivers/board.h"
#include "drivers/cortex/nvic.h"
#include "firmware/config.h"
#include "firmware/drive.h"
#include "firmware/speed_loop.h"
#include "tests/bench/loop_state.h"
#include "tests/bench/print.h"
#include "tests/bench/rows.h"
#include "tests/bench/vectors.h"

#define RPM_Q4_LIMIT (20000 * 16)
#define RPM_Q16      65536
#define EXTREMES     512u

TIMING_FUNCTION(time_measure, speed_loop_measure(&drive.tuning))
TIMING_FUNCTION(time_limit, (void)speed_loop_current_limit(&drive.tuning))
TIMING_FUNCTION(time_step, (void)speed_loop_step(&drive.tuning, drive.tuning.ramp_q16, drive.tuning.i_max_q15))
TIMING_FUNCTION(time_drive_step, drive_step())

static uint32_t interrupting(void)
{
    return rows_time_interrupt(BOARD_IRQ_TICK);
}

/* A drive in operation at any speed, and what drive_step() looks at besides. */
static void set_state(int32_t speed_q32, int32_t ref_rpm, int32_t target_rpm, int64_t integral_q16)
{
    loop_state_typical(&current_loop);
    current_loop.pll.speed_q32 = speed_q32;
    current_loop.radius_q15 = vector_random(4000, 17000);
    speed_loop_measure(&drive.tuning);
    speed_loop.ref_rpm_q16 = ref_rpm * RPM_Q16;
    speed_loop.target_rpm_q16 = target_rpm * RPM_Q16;
    speed_loop.integral_q16 = integral_q16;
    drive.state = DRIVE_OPERATION_ENABLED;
    drive.fault = FAULT_NONE;
}

static void set_typical(void)
{
    const int32_t speed_q32 = vector_random(-(1 << 27), 1 << 27);
    const int32_t rpm = tuning_rpm_q4(&drive.tuning, speed_q32) / 16;
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
    drive.mode = DRIVE_MODE_SPEED;
    print_states("speed_loop_measure", time_measure, NULL);
    print_states("speed_loop_current_limit", time_limit, NULL);
    print_states("speed_loop_step", time_step, NULL);
    print_states("drive_step.speed", time_drive_step, NULL);
    drive.mode = DRIVE_MODE_TORQUE;
    print_states("drive_step.torque", time_drive_step, NULL);
    drive.mode = DRIVE_MODE_SPEED;
    print_states("slow_loop.pended", NULL, interrupting);
    nvic_disable(BOARD_IRQ_TICK);
    drive.state = DRIVE_SWITCH_ON_DISABLED;
    drive.fault = FAULT_NONE;
}

/* SPDX-License-Identifier: MIT */
/* The fabric's blocks on a target: a carrier that runs, and waiting in its counts. fabric_bench_begin() first. */
#ifndef TESTS_TARGET_FABRIC_BENCH_H
#define TESTS_TARGET_FABRIC_BENCH_H

#include "drivers/board.h"
#include "drivers/fabric/fabric.h"
#include "drivers/mss/timer.h"
#include "tests/target/harness.h"

#define HALF_COUNTS     2500u
#define PERIOD_COUNTS   (2u * HALF_COUNTS)
#define DEAD_COUNTS     50u
#define MIN_COUNTS      10u
#define TICKS_PER_COUNT (BOARD_MSS_TIMER_HZ / BOARD_FABRIC_HZ)
#define PERIOD_TICKS    (PERIOD_COUNTS * TICKS_PER_COUNT)

_Static_assert(BOARD_MSS_TIMER_HZ % BOARD_FABRIC_HZ == 0u, "timer 2 counts whole fabric clocks here");

static inline struct pwm_setup fabric_bench_setup(void)
{
    return (struct pwm_setup){HALF_COUNTS, DEAD_COUNTS, MIN_COUNTS, PWM_UPDATE_VALLEY, 0u};
}

/* False, after it has said so, where there is no fabric that the drivers know. */
static inline bool fabric_bench_begin(void)
{
    const struct pwm_setup setup = fabric_bench_setup();
    (void)harness_begin();
    mss_timer2_start_free_running();
    return harness_true("gate: identity of the fabric", gate_id_ok(&FABRIC0->gate)) &&
           harness_true("pwm: comes up", pwm_init(&FABRIC0->pwm, &setup));
}

static inline void wait_counts(uint32_t counts)
{
    const uint32_t start = mss_timer2_now();
    while (mss_timer2_now() - start < counts * TICKS_PER_COUNT) {
        /* time passes */
    }
}

static inline void write_compares(uint32_t counts)
{
    FABRIC0->pwm.COMPARE_A = counts;
    FABRIC0->pwm.COMPARE_B = counts;
    FABRIC0->pwm.COMPARE_C = counts;
}

#endif

/* SPDX-License-Identifier: MIT */
/* The driver of the gate against docs/fabric.md: its latches and the brake chopper. */
#include "tests/target/fabric_bench.h"

/* Everything the gate's status shows while all legs go through their on-times in steps of a twentieth, and beyond. */
static uint32_t on_times_status(void)
{
    uint32_t status = 0;
    for (uint32_t compare = 0; compare <= HALF_COUNTS + HALF_COUNTS / 20u; compare += HALF_COUNTS / 20u) {
        write_compares(compare);
        wait_counts(PERIOD_COUNTS + 20u);
        (void)gate_enable(&FABRIC0->gate);
        wait_counts(2u * PERIOD_COUNTS);
        status |= gate_status(&FABRIC0->gate);
    }
    return status;
}

static void test_gate(void)
{
    harness_equal("gate: nothing latched", gate_clear(&FABRIC0->gate, GATE_STATUS_LATCHES), 0u);
    harness_true("gate: off at first", (gate_status(&FABRIC0->gate) & GATE_STATUS_LIVE) == 0u);
    harness_true("gate: enable", gate_enable(&FABRIC0->gate));
    harness_equal("gate: live, nothing else", gate_status(&FABRIC0->gate), GATE_STATUS_LIVE);
    gate_disable(&FABRIC0->gate);
    harness_equal("gate: disable", gate_status(&FABRIC0->gate), 0u);

    /* A loop that stops reading lets go of the bridge, and cannot take it again before the latch is cleared. */
    harness_true("gate: enable again", gate_enable(&FABRIC0->gate));
    adc_start(&FABRIC0->adc);
    wait_counts(4u * PERIOD_COUNTS);
    harness_equal("gate: an overrun while live is LOOP_LOST", gate_status(&FABRIC0->gate),
                  GATE_STATUS_LOOP_LOST | GATE_STATUS_OVERRUN);
    harness_true("gate: stays off while latched", !gate_enable(&FABRIC0->gate));
    adc_stop(&FABRIC0->adc);
    harness_equal("gate: clearing another latch", gate_clear(&FABRIC0->gate, GATE_STATUS_INTERLOCK), 0u);
    harness_equal("gate: leaves this one", gate_status(&FABRIC0->gate), GATE_STATUS_LOOP_LOST);
    harness_equal("gate: clearing it", gate_clear(&FABRIC0->gate, GATE_STATUS_LOOP_LOST), 0u);
    harness_equal("gate: does not enable", gate_status(&FABRIC0->gate), 0u);

    /* All legs alike, so that there is no voltage on the motor. */
    harness_equal("gate: nothing from end to end when live", on_times_status(), GATE_STATUS_LIVE);
    write_compares(HALF_COUNTS / 2u);
    gate_disable(&FABRIC0->gate);
    harness_equal("gate: no input of safe torque off asks",
                  gate_status(&FABRIC0->gate) & (GATE_STATUS_STO_A_NOW | GATE_STATUS_STO_B_NOW), 0u);
}

static void test_chopper(void)
{
    struct gate_regs *const gate = &FABRIC0->gate;
    harness_equal("chopper: off after a reset", gate->CHOPPER, 0u);
    gate_set_chopper(gate, 30000, 29000);
    harness_equal("chopper: enabled, and quiet at this voltage", gate->CHOPPER, GATE_CHOPPER_ENABLE);
    harness_equal("chopper: on above", gate->CHOPPER_ON, 30000u);
    harness_equal("chopper: off at", gate->CHOPPER_OFF, 29000u);
    gate_set_chopper(gate, 29000, 29000);
    harness_equal("chopper: levels that do not stand apart switch it off", gate->CHOPPER, 0u);
    gate_set_chopper(gate, 30000, 29000);
    gate_set_chopper(gate, 0, 0);
    harness_equal("chopper: none", gate->CHOPPER, 0u);

    /* Of a bus that is far above: it chops from the first sample on. */
    gate_set_chopper(gate, 2, 1);
    FABRIC0->adc.CONTROL = ADC_CONTROL_ENABLE;
    wait_counts(2u * PERIOD_COUNTS);
    harness_equal("chopper: chops", gate->CHOPPER, GATE_CHOPPER_ENABLE | GATE_CHOPPER_CHOPPING);
    adc_stop(&FABRIC0->adc);
    wait_counts(66000u);
    harness_equal("chopper: not without samples", gate->CHOPPER, GATE_CHOPPER_ENABLE);
    gate_set_chopper(gate, 0, 0);
}

#define ROUND_COUNTS (2u * PERIOD_COUNTS)

/* The word of the one whose turn it is, if it is its turn. */
static void prove(uint32_t key, bool of_thread)
{
    const uint32_t next = FABRIC0->gate.WATCH;
    if (((next & GATE_WATCH_THREAD) != 0u) == of_thread) {
        FABRIC0->gate.PROOF = key | (next & GATE_WATCH_NUMBER);
    }
}

/* Rounds of a program that lives, two periods each; returns all that the gate's status shows meanwhile. */
static uint32_t live_status(uint32_t rounds, bool slow_loop, bool thread)
{
    struct gate_regs *const gate = &FABRIC0->gate;
    uint32_t status = 0;
    for (uint32_t n = 0; n < 2u * rounds; n++) {
        write_compares(HALF_COUNTS / 2u);
        if (slow_loop && n % 2u == 0u) {
            prove(GATE_PROOF_SLOW, false);
        }
        if (thread && n % 2u == 1u) {
            prove(GATE_PROOF_THREAD, true);
        }
        wait_counts(PERIOD_COUNTS - 600u); /* the rest is for what is above, gate_prove() of the caller too */
        status |= gate_status(gate);
    }
    return status;
}

/* The same of a slow loop that gives both words. */
static uint32_t slow_loop_status(uint32_t rounds)
{
    uint32_t status = 0;
    for (uint32_t n = 0; n < rounds; n++) {
        gate_prove(&FABRIC0->gate);
        status |= live_status(1u, false, false);
    }
    return status;
}

static void restart(void)
{
    gate_disable(&FABRIC0->gate);
    (void)gate_clear(&FABRIC0->gate, GATE_STATUS_LATCHES);
    (void)gate_enable(&FABRIC0->gate);
}

/* Last: what is started stays so until a reset. */
static void test_watch(void)
{
    struct gate_regs *const gate = &FABRIC0->gate;
    (void)gate_enable(gate);
    harness_true("watch: does not start while the bridge is on", !gate_start_watch(gate, 4u * ROUND_COUNTS));
    gate_disable(gate);
    harness_true("watch: starts", gate_start_watch(gate, 4u * ROUND_COUNTS));
    harness_true("watch: keeps its time", !gate_start_watch(gate, 8u * ROUND_COUNTS));
    restart();
    harness_equal("watch: a program that lives", live_status(40u, true, true), GATE_STATUS_LIVE);
    (void)live_status(8u, false, true);
    harness_equal("watch: without the slow loop", gate_status(gate), GATE_STATUS_SLOW_LOST);
    restart();
    (void)live_status(8u, true, false);
    harness_equal("watch: without the thread", gate_status(gate), GATE_STATUS_THREAD_LOST);
    restart();
    harness_equal("watch: both words at once, from either turn", slow_loop_status(40u), GATE_STATUS_LIVE);
    (void)live_status(8u, false, false);
    harness_equal("watch: the slow loop that gave both", gate_status(gate), GATE_STATUS_SLOW_LOST);
    restart();
    wait_counts(3u * PERIOD_COUNTS);
    harness_equal("watch: without the current loop", gate_status(gate), GATE_STATUS_LOOP_LOST);
    gate_disable(gate);
    wait_counts(8u * ROUND_COUNTS);
    harness_equal("watch: nothing more while off", gate_clear(gate, GATE_STATUS_LATCHES), 0u);
}

int main(void)
{
    if (fabric_bench_begin()) {
        test_gate();
        test_chopper();
        test_watch();
    }
    harness_end();
}

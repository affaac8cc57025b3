/* SPDX-License-Identifier: MIT */
/* The driver of the gate: its latches, the brake chopper, the watch; of the registers, tests/twin/test_fabric.py. */
#include "tests/target/fabric_bench.h"

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
    harness_true("gate: stays off while latched", !gate_enable(&FABRIC0->gate));
    adc_stop(&FABRIC0->adc);
    harness_equal("gate: clearing another latch", gate_clear(&FABRIC0->gate, GATE_STATUS_INTERLOCK), 0u);
    harness_equal("gate: leaves this one", gate_status(&FABRIC0->gate), GATE_STATUS_LOOP_LOST);
    harness_equal("gate: clearing it", gate_clear(&FABRIC0->gate, GATE_STATUS_LOOP_LOST), 0u);
    harness_equal("gate: does not enable", gate_status(&FABRIC0->gate), 0u);
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
}

#define ROUND_COUNTS (2u * PERIOD_COUNTS)

/* Rounds of a program that lives, two periods each; returns all that the gate's status shows meanwhile. */
static uint32_t live_status(uint32_t rounds, bool proves)
{
    uint32_t status = 0;
    for (uint32_t n = 0; n < 2u * rounds; n++) {
        write_compares(HALF_COUNTS / 2u);
        if (proves && n % 2u == 0u) {
            gate_prove(&FABRIC0->gate);
        }
        wait_counts(PERIOD_COUNTS - 600u); /* the rest is for what is above, gate_prove() of the caller too */
        status |= gate_status(&FABRIC0->gate);
    }
    return status;
}

/* Last: what is started stays so until a reset. Who of the program's parts is missed when: tests/twin/test_fabric.py. */
static void test_watch(void)
{
    struct gate_regs *const gate = &FABRIC0->gate;
    (void)gate_enable(gate);
    harness_true("watch: does not start while the bridge is on", !gate_start_watch(gate, 4u * ROUND_COUNTS));
    gate_disable(gate);
    harness_true("watch: starts", gate_start_watch(gate, 4u * ROUND_COUNTS));
    harness_true("watch: keeps its time", !gate_start_watch(gate, 8u * ROUND_COUNTS));
    (void)gate_clear(gate, GATE_STATUS_LATCHES);
    (void)gate_enable(gate);
    harness_equal("watch: both words at once, from either turn", live_status(40u, true), GATE_STATUS_LIVE);
    (void)live_status(8u, false);
    harness_equal("watch: the slow loop that gave both", gate_status(gate), GATE_STATUS_SLOW_LOST);
    gate_disable(gate);
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

/* SPDX-License-Identifier: MIT */
/* `off` while nobody takes requests: it waits for longer than a slow loop that lives would take, and shuts the gates itself. */
#include "drivers/cortex/dwt.h"
#include "firmware/drive/drive.h"
#include "firmware/settings/config.h"
#include "tests/target/harness.h"

#define PERIOD (BOARD_M3_HZ / CONFIG_SLOW_HZ)

static struct axis axis;
static struct fabric fabric;

int main(void)
{
    (void)harness_begin();
    axis.fabric = &fabric;
    axis.request = AXIS_REQUEST_QUICK_STOP;
    gate_enable(&fabric.gate);
    (void)harness_true("there is a cycle counter", dwt_init());
    const uint32_t began = dwt_cycles();
    const struct outcome outcome = drive_switch_off(&axis);
    const uint32_t cycles = dwt_cycles() - began;
    (void)harness_equal("it is carried out", outcome.error, ERROR_NONE);
    (void)harness_equal("the gates are shut", fabric.gate.CONTROL, 0u);
    harness_note("cycles", cycles);
    (void)harness_between("after two to four periods", cycles, 2u * PERIOD, 4u * PERIOD);
    harness_end();
}

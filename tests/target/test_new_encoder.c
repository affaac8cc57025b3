/* SPDX-License-Identifier: MIT */
/*
 * Another encoder is set while the PWM runs: whoever looks at the latched count from then on sees one of the new setting. At
 * any phase between two conversions, so that chance has no part in it.
 */
#include "drivers/cortex/dwt.h"
#include "firmware/drive/drive.h"
#include "firmware/drive/requests.h"
#include "firmware/drive/retune.h"
#include "tests/target/harness.h"

#define PHASES 50u

static struct axis axis;

static uint32_t latched_at(void)
{
    return encoder_latch_clock(&FABRIC0->encoder);
}

static void wait_cycles(uint32_t cycles)
{
    const uint32_t began = dwt_cycles();
    while (dwt_cycles() - began < cycles) {
    }
}

/* Right behind a conversion the next one is a period away. */
static void wait_for_conversion(void)
{
    const uint32_t before = latched_at();
    while (latched_at() == before) {
    }
}

int main(void)
{
    (void)harness_begin();
    (void)harness_true("there is a cycle counter", dwt_init());
    drive_init(&axis, FABRIC0);
    drive_start(&axis, FAULT_NONE);
    struct tuning tuning = axis.tuning;
    uint32_t stale = 0;
    for (uint32_t phase = 0; phase < PHASES; phase++) {
        tuning.encoder_counts = phase % 2u == 0u ? 8192 : 4000;
        tuning.encoder_scale_q32 = (uint32_t)(0x100000000u / (uint32_t)tuning.encoder_counts);
        wait_for_conversion();
        wait_cycles(phase * CONFIG_PWM_COUNTS / PHASES);
        const uint32_t before = latched_at();
        apply_tuning(&axis, &tuning);
        stale += latched_at() == before ? 1u : 0u;
    }
    harness_equal("each time a conversion has come", stale, 0u);
    harness_equal("the encoder is the new one", (uint32_t)axis.tuning.encoder_counts, 4000u);
    tuning.encoder_counts = 2000; /* and half the pole pairs: the same scale */
    apply_tuning(&axis, &tuning);
    harness_equal("and the fabric counts as it has", FABRIC0->encoder.COUNTS, 2000u);
    harness_end();
}

/* SPDX-License-Identifier: MIT */
/* The driver of the encoder against docs/fabric.md: what it refuses, how it counts, what it latches. */
#include "tests/target/fabric_bench.h"

static void test_encoder(void)
{
    harness_true("encoder: refuses 3 counts", !encoder_init(&FABRIC0->encoder, ENCODER_COUNTS_MIN - 1u, false));
    harness_equal("encoder: and stays off", FABRIC0->encoder.CONTROL, 0u);
    harness_true("encoder: refuses 65537 counts", !encoder_init(&FABRIC0->encoder, ENCODER_COUNTS_MAX + 1u, false));
    struct encoder_regs *const other =
        (struct encoder_regs *)(void *)&FABRIC0->gate; /* latches where COUNTS should be */
    harness_true("encoder: refuses what does not read back", !encoder_init(other, 4000u, false));
    harness_true("encoder: takes 65536 counts", encoder_init(&FABRIC0->encoder, ENCODER_COUNTS_MAX, true));
    harness_equal("encoder: counts backwards", FABRIC0->encoder.CONTROL,
                  ENCODER_CONTROL_ENABLE | ENCODER_CONTROL_REVERSE);
    harness_true("encoder: takes 4000 counts", encoder_init(&FABRIC0->encoder, 4000u, false));
    harness_equal("encoder: counts", FABRIC0->encoder.COUNTS, 4000u);
    harness_equal("encoder: on", FABRIC0->encoder.CONTROL, ENCODER_CONTROL_ENABLE);
    harness_equal("encoder: starts at 0", encoder_position(&FABRIC0->encoder), 0u);

    adc_start(&FABRIC0->adc);
    wait_counts(2u * PERIOD_COUNTS);
    harness_equal("encoder: latched with the rotor at rest", encoder_latched(&FABRIC0->encoder),
                  encoder_position(&FABRIC0->encoder));
    adc_stop(&FABRIC0->adc);
    harness_equal("encoder: signal present", encoder_status(&FABRIC0->encoder) & ENCODER_STATUS_SIGNAL_LOST, 0u);
    encoder_clear(&FABRIC0->encoder, ENCODER_STATUS_INDEX_SEEN | ENCODER_STATUS_ILLEGAL);
    harness_equal("encoder: status cleared", encoder_status(&FABRIC0->encoder), 0u);
}

int main(void)
{
    if (fabric_bench_begin()) {
        test_encoder();
    }
    harness_end();
}

/* SPDX-License-Identifier: MIT */
/*
 * The driver of the ADC against docs/fabric.md: ends of conversions, offsets, two samples a period, modulators; and what of the
 * encoder's needs a fabric. The rest of that: tests/unit/test_drivers.py.
 */
#include "drivers/cortex/nvic.h"
#include "startup/startup.h"
#include "tests/target/fabric_bench.h"

static volatile uint32_t adc_calls, adc_first_tick, adc_last_tick, adc_statuses, adc_still_set, adc_sequence_steps;
static volatile uint32_t adc_last_sequence;

void FabricIrq0_IRQHandler(void)
{
    adc_statuses |= adc_acknowledge(&FABRIC0->adc);
    adc_still_set |= FABRIC0->adc.STATUS & ADC_STATUS_EOC;
    const uint32_t sequence = adc_sequence(&FABRIC0->adc);
    adc_sequence_steps += sequence - adc_last_sequence;
    adc_last_sequence = sequence;
    adc_last_tick = mss_timer2_now();
    if (adc_calls == 0u) {
        adc_first_tick = adc_last_tick;
    }
    adc_calls++;
}

#define NEAR_ZERO_Q15 (100 * BOARD_ADC_Q15_PER_CODE)

static bool near_q15(int32_t value_q15, int32_t expected_q15)
{
    return value_q15 >= expected_q15 - NEAR_ZERO_Q15 && value_q15 <= expected_q15 + NEAR_ZERO_Q15;
}

/* No current flows, so that a result is what the offset takes away from a sensor's zero, which is about mid-scale. */
static void test_adc_offsets(void)
{
    uint32_t offset_q15[3];
    adc_stop(&FABRIC0->adc);
    wait_counts(PERIOD_COUNTS);
    adc_offsets(&FABRIC0->adc, offset_q15);
    for (uint32_t phase = 0; phase < 3u; phase++) {
        harness_equal("adc: offset after reset", offset_q15[phase], BOARD_ADC_OFFSET_NOMINAL);
    }
    const struct adc_sample before = adc_read(&FABRIC0->adc);
    harness_true("adc: phase A about zero", near_q15(before.ia_q15, 0));
    harness_true("adc: phase B about zero", near_q15(before.ib_q15, 0));
    harness_true("adc: phase C about zero", near_q15(before.ic_q15, 0));
    harness_between("adc: bus voltage", (uint32_t)before.vbus_q15, 0u, 32760u);

    adc_set_offsets(&FABRIC0->adc,
                    (const uint32_t[3]){BOARD_ADC_OFFSET_NOMINAL - 8000u, BOARD_ADC_OFFSET_NOMINAL + 8000u, 65535u});
    adc_offsets(&FABRIC0->adc, offset_q15);
    harness_equal("adc: offset reads back", offset_q15[1], BOARD_ADC_OFFSET_NOMINAL + 8000u);
    harness_equal("adc: a result stays as it is", (uint32_t)adc_read(&FABRIC0->adc).ia_q15, (uint32_t)before.ia_q15);
    FABRIC0->adc.CONTROL = ADC_CONTROL_ENABLE;
    wait_counts(2u * PERIOD_COUNTS);
    const struct adc_sample after = adc_read(&FABRIC0->adc);
    harness_true("adc: the next has the new offset, phase A", near_q15(after.ia_q15, 8000));
    harness_true("adc: phase B", near_q15(after.ib_q15, -8000));
    harness_true("adc: phase C", near_q15(after.ic_q15, -32767));
    adc_start(&FABRIC0->adc);
}

/* Which limit is which, and what the driver does with a flag; when there is one: tests/twin/test_fabric.py. */
static void test_limits(void)
{
    struct adc_regs *const adc = &FABRIC0->adc;
    adc_set_limits(adc, 0x11111, 0x02222, 0x13333, 0x04444);
    harness_equal("limits: I_TRIP", adc->I_TRIP, 0x11111u);
    harness_equal("limits: SUM_TRIP", adc->SUM_TRIP, 0x02222u);
    harness_equal("limits: V_MIN", adc->V_MIN, 0x13333u);
    harness_equal("limits: V_MAX", adc->V_MAX, 0x04444u);
    adc_set_limits(adc, ADC_LIMIT_NONE, ADC_LIMIT_NONE, ADC_LIMIT_NONE, ADC_LIMIT_NONE);
    adc->CONTROL = ADC_CONTROL_ENABLE;
    (void)adc_read_next(adc, 2u * PERIOD_COUNTS);
    adc->CONTROL = 0u;
    harness_equal("limits: a flag is taken with the end of conversion", adc_take_status(adc),
                  ADC_STATUS_EOC | ADC_STATUS_VBUS_LOW);
    harness_equal("limits: but stays", adc_status(adc), ADC_STATUS_VBUS_LOW);
    harness_equal("limits: in the gate's status, too", gate_status(&FABRIC0->gate), GATE_STATUS_LIMIT);
    adc_set_limits(adc, ADC_LIMIT_NONE, ADC_LIMIT_NONE, 0, ADC_LIMIT_NONE);
    adc->CONTROL = ADC_CONTROL_ENABLE;
    (void)adc_read_next(adc, 2u * PERIOD_COUNTS);
    adc_stop(adc);
    harness_equal("limits: until another conversion", adc_status(adc), 0u);
}

/* Registers only: this fabric's modulators show nothing. */
static void test_select(void)
{
    struct adc_regs *const adc = &FABRIC0->adc;
    harness_true("adc: modulators", adc_select(adc, 128u, 20000, 0u));
    harness_equal("adc: 128 bits, 16 in the fast path, 20 MHz", adc->MODULATOR, 0x512u);
    harness_equal("adc: their trip", adc->MODULATOR_TRIP, 20000u);
    harness_equal("adc: on, with modulators", adc->CONTROL, 0xBu);
    const uint32_t sequence = adc_sequence(adc);
    harness_true("adc: the same again", adc_select(adc, 128u, 20001, 0u));
    wait_counts(3u * PERIOD_COUNTS);
    harness_true("adc: it converts", adc_sequence(adc) - sequence >= 2u);
    harness_true("adc: shunts", adc_select(adc, 0u, 20001, 120u));
    harness_equal("adc: what they do not see is reconstructed", adc->CONTROL, 7u);
    harness_equal("adc: until they have settled", adc->SETTLE, 120u);
    harness_true("adc: more than the register holds", !adc_select(adc, 0u, 20001, 4096u));
    harness_true("adc: the converters again", adc_select(adc, 0u, 20001, 0u));
    harness_equal("adc: on, without", adc->CONTROL, 3u);
    harness_equal("adc: always valid", adc->SETTLE, 0u);
    adc_stop(adc);
}

/* The second one comes half a period later, and the driver waits for it. */
static void test_two_samples(void)
{
    FABRIC0->adc.CONTROL = ADC_CONTROL_ENABLE;
    harness_true("pwm: two samples a period", pwm_set_samples(&FABRIC0->pwm, 2u, 0u));
    harness_equal("pwm: the other in the middle of the high sides' time", FABRIC0->pwm.TRIGGER_2,
                  (DEAD_COUNTS / 2u) | PWM_TRIGGER_RISING);
    wait_counts(2u * PERIOD_COUNTS);
    const uint32_t before = adc_sequence(&FABRIC0->adc);
    wait_counts(10u * PERIOD_COUNTS);
    harness_between("adc: two conversions a period", adc_sequence(&FABRIC0->adc) - before, 20u, 21u);
    uint32_t clock = encoder_latch_clock(&FABRIC0->encoder);
    const uint32_t newest = adc_sequence(&FABRIC0->adc);
    (void)adc_read_next(&FABRIC0->adc, PERIOD_COUNTS);
    harness_equal("adc: the next one is waited for", adc_sequence(&FABRIC0->adc) - newest, 1u);
    harness_equal("adc: half a period later", encoder_latch_clock(&FABRIC0->encoder) - clock, HALF_COUNTS);
    harness_true("pwm: one sample a period", pwm_set_samples(&FABRIC0->pwm, 1u, 0u));
    wait_counts(2u * PERIOD_COUNTS);
    clock = adc_sequence(&FABRIC0->adc);
    wait_counts(10u * PERIOD_COUNTS);
    harness_between("adc: one conversion a period", adc_sequence(&FABRIC0->adc) - clock, 10u, 11u);
    adc_stop(&FABRIC0->adc);
    const uint32_t stopped = adc_sequence(&FABRIC0->adc);
    (void)adc_read_next(&FABRIC0->adc, 10u);
    harness_equal("adc: one that does not come is not waited for", adc_sequence(&FABRIC0->adc), stopped);
}

static uint32_t reading_ticks(const struct adc_regs *adc)
{
    const uint32_t start = mss_timer2_now();
    (void)adc_read(adc);
    return mss_timer2_now() - start;
}

/* SEQUENCE is timer 2 itself here, which never stands still: a reading is made twice, and taken as it is. */
static void test_reading_ends(void)
{
    _Static_assert(offsetof(struct adc_regs, SEQUENCE) == offsetof(struct mss_timer_regs, TIM2_VAL), "of both blocks");
    static const struct adc_regs still;
    const uint32_t once = reading_ticks(&still);
    harness_between("adc: a reading that a conversion came into is made again, once",
                    reading_ticks((const struct adc_regs *)(const void *)MSS_TIMER), once * 5u / 4u, once * 5u / 2u);
}

static void test_adc(void)
{
    const uint32_t idle = adc_sequence(&FABRIC0->adc);
    wait_counts(3u * PERIOD_COUNTS);
    harness_equal("adc: no conversion before the start", adc_sequence(&FABRIC0->adc) - idle, 0u);

    adc_last_sequence = adc_sequence(&FABRIC0->adc);
    adc_start(&FABRIC0->adc);
    nvic_enable(BOARD_IRQ_ADC);
    wait_counts(10u * PERIOD_COUNTS + PERIOD_COUNTS / 2u);
    nvic_disable(BOARD_IRQ_ADC);
    const uint32_t calls = adc_calls;
    harness_between("adc: an interrupt a period", calls, 10u, 11u);
    harness_equal("adc: and a conversion an interrupt", adc_sequence_steps, calls);
    harness_between("adc: in step with the PWM", adc_last_tick - adc_first_tick, (calls - 1u) * PERIOD_TICKS - 20u,
                    (calls - 1u) * PERIOD_TICKS + 20u);
    harness_equal("adc: end of conversion, no overrun", adc_statuses, ADC_STATUS_EOC);
    harness_equal("adc: acknowledged", adc_still_set, 0u);

    test_adc_offsets();
    adc_stop(&FABRIC0->adc);
    test_limits();
    test_two_samples();
    test_select();
    adc_start(&FABRIC0->adc);
    wait_counts(3u * PERIOD_COUNTS);
    harness_true("adc: pending while nobody serves it", nvic_is_pending(BOARD_IRQ_ADC));
    harness_equal("adc: overrun shows in the gate's status", gate_status(&FABRIC0->gate), GATE_STATUS_OVERRUN);
    harness_equal("adc: overrun when nobody reads", adc_acknowledge(&FABRIC0->adc),
                  ADC_STATUS_EOC | ADC_STATUS_OVERRUN);
    harness_equal("adc: cleared", FABRIC0->adc.STATUS, 0u);
    harness_equal("adc: in the gate's status, too", gate_status(&FABRIC0->gate), 0u);

    adc_stop(&FABRIC0->adc);
    nvic_clear_pending(BOARD_IRQ_ADC); /* of a conversion that ended while the lines above were printed */
    const uint32_t stopped = adc_sequence(&FABRIC0->adc);
    wait_counts(3u * PERIOD_COUNTS);
    harness_equal("adc: no conversion after the stop", adc_sequence(&FABRIC0->adc) - stopped, 0u);
    harness_equal("adc: nothing pending after the stop", FABRIC0->adc.STATUS, 0u);
    harness_true("adc: nor in the NVIC", !nvic_is_pending(BOARD_IRQ_ADC));
}

static void test_encoder(void)
{
    struct encoder_regs *const other =
        (struct encoder_regs *)(void *)&FABRIC0->gate; /* latches where COUNTS should be */
    harness_true("encoder: refuses what does not read back", !encoder_init(other, 4000u, false));
    harness_true("encoder: takes 4000 counts", encoder_init(&FABRIC0->encoder, 4000u, false));
    adc_start(&FABRIC0->adc);
    wait_counts(2u * PERIOD_COUNTS);
    harness_equal("encoder: latched with the rotor at rest", encoder_latched(&FABRIC0->encoder),
                  encoder_position(&FABRIC0->encoder));
    adc_stop(&FABRIC0->adc);
    encoder_clear(&FABRIC0->encoder, ENCODER_STATUS_INDEX_SEEN | ENCODER_STATUS_ILLEGAL);
    harness_equal("encoder: no signal lost, the rest is cleared", encoder_status(&FABRIC0->encoder), 0u);
}

int main(void)
{
    if (fabric_bench_begin()) {
        test_reading_ends();
        test_adc();
        test_encoder();
    }
    harness_end();
}

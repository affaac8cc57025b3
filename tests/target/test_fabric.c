/* SPDX-License-Identifier: MIT */
/*
 * Drivers of the fabric blocks against docs/fabric.md: CorePWM's ways, the edges for every on-time, the ADC's end of
 * conversion, the encoder's counter and the gate's latches.
 *
 * One test commands both sides of a phase on, to see the interlock: on a real power stage run it without bus voltage.
 */
#include "drivers/board.h"
#include "drivers/cortex/nvic.h"
#include "drivers/fabric/fabric.h"
#include "drivers/mss/timer.h"
#include "drivers/mss/watchdog.h"
#include "startup/startup.h"
#include "tests/target/harness.h"

#define PERIOD_COUNTS   5000u
#define DEAD_COUNTS     50u
#define TICKS_PER_COUNT (BOARD_MSS_TIMER_HZ / BOARD_FABRIC_HZ)
#define PERIOD_TICKS    (PERIOD_COUNTS * TICKS_PER_COUNT)

_Static_assert(BOARD_MSS_TIMER_HZ % BOARD_FABRIC_HZ == 0u, "timer 2 counts whole fabric clocks here");

static void wait_counts(uint32_t counts)
{
    const uint32_t start = mss_timer2_now();
    while (mss_timer2_now() - start < counts * TICKS_PER_COUNT) {
        /* time passes */
    }
}

/* ---- CorePWM ---- */

static volatile uint32_t *const edge_regs[12] = {
    &FABRIC0->pwm.PWM1_POSEDGE, &FABRIC0->pwm.PWM1_NEGEDGE, &FABRIC0->pwm.PWM2_POSEDGE, &FABRIC0->pwm.PWM2_NEGEDGE,
    &FABRIC0->pwm.PWM3_POSEDGE, &FABRIC0->pwm.PWM3_NEGEDGE, &FABRIC0->pwm.PWM4_POSEDGE, &FABRIC0->pwm.PWM4_NEGEDGE,
    &FABRIC0->pwm.PWM5_POSEDGE, &FABRIC0->pwm.PWM5_NEGEDGE, &FABRIC0->pwm.PWM6_POSEDGE, &FABRIC0->pwm.PWM6_NEGEDGE,
};

/*
 * What is wrong with the edges in effect for a wanted on-time: each has to be where docs/fabric.md puts it for the
 * on-time held to its limits, inside 1 ... P-1, in the order low off, high on, high off, low on, with the dead time
 * between the sides. Returns a count of violations.
 */
static uint32_t edge_violations(uint32_t leg, uint32_t wanted, uint32_t dead, uint32_t period)
{
    const uint32_t high_on = *edge_regs[4u * leg];
    const uint32_t high_off = *edge_regs[4u * leg + 1u];
    const uint32_t low_on = *edge_regs[4u * leg + 2u];
    const uint32_t low_off = *edge_regs[4u * leg + 3u];

    const uint32_t max = period - 2u * dead - 2u;
    uint32_t on = wanted;
    if ((wanted & 0x80000000u) != 0u || wanted == 0u) {
        on = 1u;
    } else if (wanted > max) {
        on = max;
    }
    const uint32_t first = (period - on) / 2u;
    uint32_t violations = 0;
    violations += high_on != first || high_off != first + on ? 1u : 0u;
    violations += low_off != first - dead || low_on != first + on + dead ? 1u : 0u;
    violations += low_off < 1u || low_on > period - 1u ? 1u : 0u;
    violations += high_on - low_off != dead || low_on - high_off != dead ? 1u : 0u;
    violations += high_off <= high_on || low_on <= low_off ? 1u : 0u;
    return violations;
}

/* Every on-time from below 0 to beyond the period, on all legs at different values, read back when in effect. */
static uint32_t sweep(uint32_t period, uint32_t dead)
{
    uint32_t violations = 0;
    for (uint32_t i = 0; i <= period + 4u; i++) {
        const uint32_t a = i - 2u; /* begins at -2 */
        const uint32_t b = period + 2u - i;
        const uint32_t c = (i * 7u) % (period + 1u);
        corepwm_write_legs(&FABRIC0->pwm, a, b, c, dead, period);
        wait_counts(period + 20u);
        violations += edge_violations(0u, a, dead, period);
        violations += edge_violations(1u, b, dead, period);
        violations += edge_violations(2u, c, dead, period);
        watchdog_refresh();
    }
    return violations;
}

static void test_corepwm_init(void)
{
    harness_true("corepwm: refuses a period too short", !corepwm_init(&FABRIC0->pwm, COREPWM_PERIOD_MIN - 1u));
    harness_true("corepwm: refuses a period over 16 bits", !corepwm_init(&FABRIC0->pwm, COREPWM_PERIOD_MAX + 1u));
    harness_true("corepwm: comes up", corepwm_init(&FABRIC0->pwm, PERIOD_COUNTS));
    harness_equal("corepwm: prescale in effect", FABRIC0->pwm.PRESCALE, 0u);
    harness_equal("corepwm: period in effect", FABRIC0->pwm.PERIOD, PERIOD_COUNTS - 1u);
    harness_equal("corepwm: only the trigger is enabled", FABRIC0->pwm.PWM_ENABLE_0_7, COREPWM_ENABLE_TRIGGER);
    harness_equal("corepwm: trigger at 0", FABRIC0->pwm.PWM7_POSEDGE, 0u);
    harness_true("corepwm: trigger's edges differ", FABRIC0->pwm.PWM7_NEGEDGE != 0u);
    harness_equal("corepwm: legs prepared at half",
                  edge_violations(0u, PERIOD_COUNTS / 2u, PERIOD_COUNTS / 8u, PERIOD_COUNTS), 0u);
    harness_true("corepwm: comes up again, already running", corepwm_init(&FABRIC0->pwm, PERIOD_COUNTS));
    harness_equal("corepwm: longest on-time", corepwm_on_max(PERIOD_COUNTS, DEAD_COUNTS), PERIOD_COUNTS - 102u);
    harness_equal("corepwm: none if the dead time eats the period", corepwm_on_max(100u, 50u), 0u);
}

static uint32_t legs_violations(uint32_t on)
{
    return edge_violations(0u, on, DEAD_COUNTS, PERIOD_COUNTS) + edge_violations(1u, on, DEAD_COUNTS, PERIOD_COUNTS) +
           edge_violations(2u, on, DEAD_COUNTS, PERIOD_COUNTS);
}

/* Writes new edges and waits for them; returns timer 2 just after the period end that brought them. */
static uint32_t period_end(uint32_t on)
{
    corepwm_write_legs(&FABRIC0->pwm, on, on, on, DEAD_COUNTS, PERIOD_COUNTS);
    const uint32_t start = mss_timer2_now();
    const uint32_t last = (PERIOD_COUNTS - on) / 2u - DEAD_COUNTS;
    while (FABRIC0->pwm.PWM6_NEGEDGE != last && mss_timer2_now() - start < 2u * PERIOD_TICKS) {
        /* bounded */
    }
    return mss_timer2_now();
}

/*
 * Begins an update at every count from 80 before the end of a period to 20 after it, so that the end falls between any
 * two of its stores, and counts the updates of which only a part was in effect afterwards.
 */
static uint32_t torn_updates(void)
{
    uint32_t torn = 0;
    for (uint32_t lead = 0; lead <= 100u; lead++) {
        const uint32_t begin = period_end(1000u) + (PERIOD_COUNTS - 80u + lead) * TICKS_PER_COUNT;
        while ((int32_t)(mss_timer2_now() - begin) < 0) {
            /* time passes */
        }
        corepwm_write_legs(&FABRIC0->pwm, 3000u, 3000u, 3000u, DEAD_COUNTS, PERIOD_COUNTS);
        wait_counts(100u);
        torn += legs_violations(1000u) != 0u && legs_violations(3000u) != 0u ? 1u : 0u;
    }
    return torn;
}

/* New edges come together, at the end of a period and not before; without SYNC_UPDATE not at all. */
static void test_corepwm_update(void)
{
    corepwm_write_legs(&FABRIC0->pwm, 1000u, 1000u, 1000u, DEAD_COUNTS, PERIOD_COUNTS);
    wait_counts(PERIOD_COUNTS + 20u);
    harness_equal("corepwm: edges in effect after a period", FABRIC0->pwm.PWM1_POSEDGE, 2000u);

    FABRIC0->pwm.SYNC_UPDATE = 0u;
    FABRIC0->pwm.PWM1_POSEDGE = 1999u;
    wait_counts(2u * PERIOD_COUNTS);
    harness_equal("corepwm: without SYNC_UPDATE the old edge stays", FABRIC0->pwm.PWM1_POSEDGE, 2000u);
    FABRIC0->pwm.SYNC_UPDATE = 1u;
    wait_counts(PERIOD_COUNTS + 20u);
    harness_equal("corepwm: with it the new one comes", FABRIC0->pwm.PWM1_POSEDGE, 1999u);

    /* All twelve change at one instant: watched from the first to change, none of the others is old. */
    (void)period_end(3000u);
    harness_equal("corepwm: edges change together", legs_violations(3000u), 0u);
    harness_equal("corepwm: none is taken alone when the period ends while they are written", torn_updates(), 0u);

    corepwm_enable_legs(&FABRIC0->pwm, true);
    wait_counts(PERIOD_COUNTS + 20u);
    harness_equal("corepwm: legs enabled", FABRIC0->pwm.PWM_ENABLE_0_7, COREPWM_ENABLE_TRIGGER | COREPWM_ENABLE_LEGS);
    corepwm_enable_legs(&FABRIC0->pwm, false);
    wait_counts(PERIOD_COUNTS + 20u);
    harness_equal("corepwm: legs disabled, trigger not", FABRIC0->pwm.PWM_ENABLE_0_7, COREPWM_ENABLE_TRIGGER);
}

static void test_corepwm_edges(void)
{
    harness_equal("corepwm: edges for every on-time, P 5000, dead 50", sweep(PERIOD_COUNTS, DEAD_COUNTS), 0u);
    uint32_t violations = 0;
    for (uint32_t dead = 0; dead <= 8u; dead++) {
        (void)corepwm_init(&FABRIC0->pwm, 200u);
        violations += sweep(200u, dead);
        (void)corepwm_init(&FABRIC0->pwm, 201u);
        violations += sweep(201u, dead);
    }
    harness_equal("corepwm: edges for every on-time, P 200 and 201, dead 0...8", violations, 0u);
    harness_true("corepwm: back to 20 kHz", corepwm_init(&FABRIC0->pwm, PERIOD_COUNTS));
}

/* ---- ADC ---- */

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
    harness_equal("adc: bus voltage has 12 bits", (uint32_t)before.vbus_q15 % 8u, 0u);

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
    harness_true("adc: phase C, at the lower end", near_q15(after.ic_q15, -32767) && after.ic_q15 >= -32767);
    adc_set_offsets(&FABRIC0->adc, (const uint32_t[3]){0u, BOARD_ADC_OFFSET_NOMINAL, BOARD_ADC_OFFSET_NOMINAL});
    wait_counts(2u * PERIOD_COUNTS);
    harness_true("adc: phase A, at the upper end",
                 near_q15(adc_read(&FABRIC0->adc).ia_q15, 32767) && adc_read(&FABRIC0->adc).ia_q15 <= 32767);
    FABRIC0->adc.OFFSET_A = 0xFFFF0000u + BOARD_ADC_OFFSET_NOMINAL;
    harness_equal("adc: an offset has 16 bits", FABRIC0->adc.OFFSET_A, BOARD_ADC_OFFSET_NOMINAL);
    adc_start(&FABRIC0->adc);
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

/* ---- encoder ---- */

static void test_encoder(void)
{
    harness_true("encoder: refuses 3 counts", !encoder_init(&FABRIC0->encoder, ENCODER_COUNTS_MIN - 1u, false));
    harness_equal("encoder: and stays off", FABRIC0->encoder.CONTROL, 0u);
    harness_true("encoder: refuses 65537 counts", !encoder_init(&FABRIC0->encoder, ENCODER_COUNTS_MAX + 1u, false));
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

/* ---- gate ---- */

/* Everything the gate's status shows while all legs go through their on-times in steps of a twentieth. */
static uint32_t on_times_status(uint32_t dead_counts, bool live)
{
    uint32_t status = 0;
    for (uint32_t on = 0; on <= PERIOD_COUNTS; on += PERIOD_COUNTS / 20u) {
        corepwm_write_legs(&FABRIC0->pwm, on, on, on, dead_counts, PERIOD_COUNTS);
        corepwm_enable_legs(&FABRIC0->pwm, true);
        wait_counts(PERIOD_COUNTS + 20u);
        if (live) {
            (void)gate_enable(&FABRIC0->gate);
        }
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

    /*
     * The edges the driver writes never overlap. With one count of dead time real switches would, as they take longer
     * than that: gates off. All legs alike, so that there is no voltage on the motor.
     */
    harness_equal("gate: no interlock from end to end with one count of dead time", on_times_status(1u, false), 0u);
    harness_equal("gate: nothing from end to end when live", on_times_status(DEAD_COUNTS, true), GATE_STATUS_LIVE);

    /* Edges that do overlap: both sides of phase A on for 100 counts. */
    corepwm_write_legs(&FABRIC0->pwm, 3000u, 3000u, 3000u, DEAD_COUNTS, PERIOD_COUNTS);
    wait_counts(PERIOD_COUNTS + 20u);
    FABRIC0->pwm.SYNC_UPDATE = 0u;
    FABRIC0->pwm.PWM2_POSEDGE = 3900u;
    FABRIC0->pwm.PWM2_NEGEDGE = 900u;
    FABRIC0->pwm.SYNC_UPDATE = 1u;
    wait_counts(3u * PERIOD_COUNTS);
    harness_equal("gate: overlapping edges are INTERLOCK", gate_status(&FABRIC0->gate), GATE_STATUS_INTERLOCK);
    corepwm_enable_legs(&FABRIC0->pwm, false);
    wait_counts(PERIOD_COUNTS + 20u);
    harness_equal("gate: interlock clears", gate_clear(&FABRIC0->gate, GATE_STATUS_INTERLOCK), 0u);
    gate_disable(&FABRIC0->gate);
}

int main(void)
{
    (void)harness_begin();
    mss_timer2_start_free_running();
    if (harness_true("gate: identity of the fabric", gate_id_ok(&FABRIC0->gate))) {
        test_corepwm_init();
        test_corepwm_update();
        test_adc();
        test_encoder();
        test_gate();
        test_corepwm_edges();
    }
    harness_end();
}

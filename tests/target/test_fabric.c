/* SPDX-License-Identifier: MIT */
/*
 * Drivers of the fabric blocks against docs/fabric.md: the PWM's settings and when a set of compares acts, the ADC's end of
 * conversion, the encoder's counter, the gate's latches and the brake chopper.
 */
#include "drivers/board.h"
#include "drivers/cortex/nvic.h"
#include "drivers/fabric/fabric.h"
#include "drivers/mss/timer.h"
#include "drivers/mss/watchdog.h"
#include "startup/startup.h"
#include "tests/target/harness.h"

#define HALF_COUNTS     2500u
#define PERIOD_COUNTS   (2u * HALF_COUNTS)
#define DEAD_COUNTS     50u
#define MIN_COUNTS      10u
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

/* ---- PWM ---- */

static const struct pwm_setup setup = {HALF_COUNTS, DEAD_COUNTS, MIN_COUNTS, PWM_UPDATE_VALLEY};

static bool refused(struct pwm_setup wrong)
{
    return !pwm_init(&FABRIC0->pwm, &wrong) && FABRIC0->pwm.CONTROL == 0u;
}

static void test_pwm_init(void)
{
    struct pwm_regs *const pwm = &FABRIC0->pwm;
    harness_true("pwm: refuses a period too short", refused((struct pwm_setup){PWM_HALF_MIN - 1u, 5u, 1u, 0u}));
    harness_true("pwm: refuses a period over 16 bits", refused((struct pwm_setup){PWM_HALF_MAX + 1u, 50u, 10u, 0u}));
    harness_true("pwm: refuses no dead time", refused((struct pwm_setup){2500u, 0u, 10u, 0u}));
    harness_true("pwm: refuses a dead time over 8 bits", refused((struct pwm_setup){2500u, 256u, 10u, 0u}));
    harness_true("pwm: refuses one that takes all", refused((struct pwm_setup){50u, 50u, 10u, 0u}));
    harness_true("pwm: refuses no shortest pulse", refused((struct pwm_setup){2500u, 50u, 0u, 0u}));
    harness_true("pwm: refuses one over 8 bits", refused((struct pwm_setup){2500u, 50u, 256u, 0u}));
    harness_true("pwm: refuses a mode there is not", refused((struct pwm_setup){2500u, 50u, 10u, 4u}));
    harness_true("pwm: comes up", pwm_init(pwm, &setup));
    harness_equal("pwm: runs", pwm->CONTROL, PWM_CONTROL_RUN);
    harness_equal("pwm: dead time", pwm->DEAD, DEAD_COUNTS);
    harness_equal("pwm: shortest pulse", pwm->MIN_PULSE, MIN_COUNTS);
    harness_equal("pwm: triggers in the middle of the low sides' time", pwm->TRIGGER_1,
                  (HALF_COUNTS - DEAD_COUNTS / 2u) | PWM_TRIGGER_FALLING);
    harness_equal("pwm: once a period", pwm->TRIGGER_2, 0u);
    harness_equal("pwm: all phases at half", pwm->COMPARE_C, HALF_COUNTS / 2u);
    harness_true("pwm: comes up again, already running", pwm_init(pwm, &setup));
}

/* What the legs depend on holds still while the carrier runs. */
static void test_pwm_locked(void)
{
    struct pwm_regs *const pwm = &FABRIC0->pwm;
    volatile uint32_t *const settings[5] = {&pwm->PERIOD, &pwm->DEAD, &pwm->MIN_PULSE, &pwm->MODE, &pwm->PHASE};
    for (uint32_t n = 0; n < 5u; n++) {
        const uint32_t before = *settings[n];
        *settings[n] = 3u;
        harness_equal("pwm: a setting written while it runs is not taken", *settings[n], before);
    }
}

/* Waits until the carrier has just left the valley, and so for a set that waits for it. */
static void wait_valley(void)
{
    for (uint32_t poll = 0; poll < 10u * PERIOD_COUNTS && (FABRIC0->pwm.STATUS & PWM_STATUS_RISING) == 0u; poll++) {
        /* bounded */
    }
    for (uint32_t poll = 0; poll < 10u * PERIOD_COUNTS && (FABRIC0->pwm.STATUS & PWM_STATUS_RISING) != 0u; poll++) {
        /* bounded */
    }
}

static void write_compares(uint32_t counts)
{
    FABRIC0->pwm.COMPARE_A = counts;
    FABRIC0->pwm.COMPARE_B = counts;
    FABRIC0->pwm.COMPARE_C = counts;
}

static bool waits(void)
{
    return (FABRIC0->pwm.STATUS & PWM_STATUS_WAITING) != 0u;
}

static void test_pwm_update(void)
{
    wait_valley();
    FABRIC0->pwm.COMPARE_A = 1000u;
    FABRIC0->pwm.COMPARE_B = 1000u;
    harness_true("pwm: two of three compares are no set", !waits());
    FABRIC0->pwm.COMPARE_C = 1000u;
    harness_true("pwm: the third commits it", waits());
    wait_counts(HALF_COUNTS + 100u);
    harness_true("pwm: it passes the peak", waits());
    wait_valley();
    harness_true("pwm: and acts at the valley", !waits());
    write_compares(1200u);
    FABRIC0->pwm.COMPARE_A = 1300u;
    harness_true("pwm: a write of the next set withdraws one that waits", !waits());
    harness_equal("pwm: compares read as written", FABRIC0->pwm.COMPARE_A, 1300u);
}

/* Whether a set written shortly behind the valley still waits: at once, behind the peak, behind the next valley. */
static uint32_t waits_in(enum pwm_update update)
{
    harness_true("pwm: another mode", pwm_set_update(&FABRIC0->pwm, update));
    harness_equal("pwm: it is the one", FABRIC0->pwm.MODE, (uint32_t)update);
    wait_valley();
    write_compares(update == PWM_UPDATE_ONCE ? 1400u : 1100u);
    wait_counts(4u);
    uint32_t waiting = waits() ? 1u : 0u;
    wait_counts(HALF_COUNTS + 100u);
    waiting |= waits() ? 2u : 0u;
    wait_valley();
    return waiting | (waits() ? 4u : 0u);
}

static void test_pwm_modes(void)
{
    harness_equal("pwm: at the valley", waits_in(PWM_UPDATE_VALLEY), 3u);
    harness_equal("pwm: at the next end", waits_in(PWM_UPDATE_ENDS), 1u);
    harness_equal("pwm: at once", waits_in(PWM_UPDATE_ONCE), 0u);
    harness_true("pwm: nothing had to wait", !pwm_fell_back(&FABRIC0->pwm));
    wait_valley();
    wait_counts(200u);
    write_compares(HALF_COUNTS - 100u);
    wait_counts(4u);
    harness_true("pwm: too late for so long a pulse", waits() && pwm_fell_back(&FABRIC0->pwm));
    wait_counts(HALF_COUNTS);
    harness_true("pwm: it acts from the peak on", !waits() && pwm_fell_back(&FABRIC0->pwm));
    wait_valley();
    wait_counts(200u);
    write_compares(1000u);
    wait_counts(4u);
    harness_true("pwm: too late to shorten it as well", waits() && pwm_fell_back(&FABRIC0->pwm));
    wait_valley();
    wait_counts(200u);
    write_compares(1200u);
    wait_counts(4u);
    harness_true("pwm: the next set acts at once again", !waits() && !pwm_fell_back(&FABRIC0->pwm));
}

/* Counts from the valley, 0 ... 2 HALF_COUNTS - 1. */
static uint32_t way(void)
{
    const uint32_t count = FABRIC0->pwm.COUNT;
    return (FABRIC0->pwm.STATUS & PWM_STATUS_RISING) != 0u ? HALF_COUNTS + count : HALF_COUNTS - count;
}

/* From any place: behind the valley, half way down, half way up, before the valley. */
static void test_pwm_goes_on(void)
{
    static const uint32_t places[4] = {50u, HALF_COUNTS / 2u, HALF_COUNTS * 3u / 2u, 2u * HALF_COUNTS - 400u};
    for (uint32_t n = 0; n < 4u; n++) {
        wait_valley();
        wait_counts(places[n]);
        const uint32_t from = way();
        harness_true("pwm: mode changed on the way", pwm_set_update(&FABRIC0->pwm, (enum pwm_update)(n & 1u)));
        const uint32_t gone = way() - from;
        harness_true("pwm: the carrier goes on from where it stood", gone < 500u);
        harness_true("pwm: it runs", (FABRIC0->pwm.STATUS & PWM_STATUS_RUNNING) != 0u);
    }
    harness_true("pwm: the mode of the other tests", pwm_set_update(&FABRIC0->pwm, PWM_UPDATE_VALLEY));
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

/* Early by more than half a dead time the trigger stands on the other side of the end. */
static void test_early_triggers(void)
{
    harness_true("pwm: early triggers", pwm_set_samples(&FABRIC0->pwm, 2u, 480u));
    harness_equal("pwm: before the valley", FABRIC0->pwm.TRIGGER_1,
                  (HALF_COUNTS - (480u - DEAD_COUNTS / 2u)) | PWM_TRIGGER_RISING);
    harness_equal("pwm: before the peak", FABRIC0->pwm.TRIGGER_2, (480u - DEAD_COUNTS / 2u) | PWM_TRIGGER_FALLING);
    harness_true("pwm: hardly early", pwm_set_samples(&FABRIC0->pwm, 2u, 10u));
    harness_equal("pwm: still behind the valley", FABRIC0->pwm.TRIGGER_1,
                  (HALF_COUNTS - (DEAD_COUNTS / 2u - 10u)) | PWM_TRIGGER_FALLING);
    harness_equal("pwm: still behind the peak", FABRIC0->pwm.TRIGGER_2, (DEAD_COUNTS / 2u - 10u) | PWM_TRIGGER_RISING);
    harness_true("pwm: as before", pwm_set_samples(&FABRIC0->pwm, 1u, 0u));
    harness_equal("pwm: in the middle", FABRIC0->pwm.TRIGGER_1, (HALF_COUNTS - DEAD_COUNTS / 2u) | PWM_TRIGGER_FALLING);
}

/* Registers only: this fabric's modulators show nothing. */
static void test_select(void)
{
    struct adc_regs *const adc = &FABRIC0->adc;
    harness_true("adc: modulators", adc_select(adc, 128u, 20000));
    harness_equal("adc: 128 bits, 16 in the fast path, 20 MHz", adc->MODULATOR, 0x512u);
    harness_equal("adc: their trip", adc->MODULATOR_TRIP, 20000u);
    harness_equal("adc: on, with modulators", adc->CONTROL, 0xBu);
    const uint32_t sequence = adc_sequence(adc);
    harness_true("adc: the same again", adc_select(adc, 128u, 20001));
    wait_counts(3u * PERIOD_COUNTS);
    harness_true("adc: it converts", adc_sequence(adc) - sequence >= 2u);
    harness_true("adc: the converters again", adc_select(adc, 0u, 20001));
    harness_equal("adc: on, without", adc->CONTROL, 3u);
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
    test_two_samples();
    test_early_triggers();
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

/* ---- encoder ---- */

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

/* ---- gate ---- */

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

int main(void)
{
    (void)harness_begin();
    mss_timer2_start_free_running();
    if (harness_true("gate: identity of the fabric", gate_id_ok(&FABRIC0->gate))) {
        test_pwm_init();
        test_pwm_locked();
        test_pwm_update();
        test_pwm_modes();
        test_pwm_goes_on();
        test_adc();
        test_encoder();
        test_gate();
        test_chopper();
    }
    harness_end();
}

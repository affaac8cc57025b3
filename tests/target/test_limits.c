/* SPDX-License-Identifier: MIT */
/*
 * The ADC block's limits and flags against docs/fabric.md, through the driver. No current flows: the offsets make the
 * results. Sensors have noise, so what the flags have to be is worked out from the results of each conversion, with limits
 * at and beside the results of the one before. The bus needs a voltage.
 */
#include "drivers/board.h"
#include "drivers/fabric/fabric.h"
#include "drivers/mss/timer.h"
#include "startup/startup.h"
#include "tests/target/harness.h"

#define PERIOD_COUNTS 5000u
#define PERIOD_TICKS  (PERIOD_COUNTS * (BOARD_MSS_TIMER_HZ / BOARD_FABRIC_HZ))
#define NEVER         0x1FFFF /* beyond it is nothing */
#define CODE          BOARD_ADC_Q15_PER_CODE
#define VOLTAGE_CODE  8
#define FLAGS         (ADC_STATUS_CURRENT | ADC_STATUS_SUM | ADC_STATUS_VBUS_HIGH | ADC_STATUS_VBUS_LOW)

struct limits {
    int32_t i_trip, sum_trip, v_min, v_max;
};

static struct limits limits;
static struct adc_sample sample;
static bool sum_was_off;
static uint32_t missing, wrong, wrong_mirrors;

static int32_t magnitude(int32_t value)
{
    return value < 0 ? -value : value;
}

static int32_t sum_of(const struct adc_sample *s)
{
    return magnitude(s->ia_q15 + s->ib_q15 + s->ic_q15);
}

static int32_t largest_of(const struct adc_sample *s)
{
    int32_t largest = magnitude(s->ia_q15);
    largest = magnitude(s->ib_q15) > largest ? magnitude(s->ib_q15) : largest;
    return magnitude(s->ic_q15) > largest ? magnitude(s->ic_q15) : largest;
}

static int32_t at_least_0(int32_t value)
{
    return value < 0 ? 0 : value;
}

static void set_limits(int32_t i_trip, int32_t sum_trip, int32_t v_min, int32_t v_max)
{
    limits = (struct limits){at_least_0(i_trip), at_least_0(sum_trip), at_least_0(v_min), at_least_0(v_max)};
    adc_set_limits(&FABRIC0->adc, limits.i_trip, limits.sum_trip, limits.v_min, limits.v_max);
}

static void no_limits(void)
{
    set_limits(NEVER, NEVER, 0, NEVER);
}

/* What the newest sample's flags have to be; remembers its sum for the next. */
static uint32_t expected_flags(void)
{
    const bool sum_off = sum_of(&sample) > limits.sum_trip;
    uint32_t flags = largest_of(&sample) > limits.i_trip ? ADC_STATUS_CURRENT : 0u;
    flags |= sum_off && sum_was_off ? ADC_STATUS_SUM : 0u;
    flags |= sample.vbus_q15 > limits.v_max ? ADC_STATUS_VBUS_HIGH : 0u;
    flags |= sample.vbus_q15 < limits.v_min ? ADC_STATUS_VBUS_LOW : 0u;
    sum_was_off = sum_off;
    return flags;
}

/* One conversion and no more. Returns its status, and counts what is not as it has to be. */
static uint32_t convert(void)
{
    const uint32_t before = adc_sequence(&FABRIC0->adc);
    const uint32_t start = mss_timer2_now();
    FABRIC0->adc.CONTROL = ADC_CONTROL_ENABLE;
    while (adc_sequence(&FABRIC0->adc) == before && mss_timer2_now() - start < 3u * PERIOD_TICKS) {
        /* bounded */
    }
    FABRIC0->adc.CONTROL = 0u;
    missing += adc_sequence(&FABRIC0->adc) - before != 1u ? 1u : 0u;
    sample = adc_read(&FABRIC0->adc);
    const uint32_t flags = expected_flags();
    const uint32_t gate = flags != 0u ? GATE_STATUS_LIMIT : 0u;
    const uint32_t status = adc_status(&FABRIC0->adc);
    wrong += status != (ADC_STATUS_EOC | flags) ? 1u : 0u;
    wrong_mirrors += (gate_status(&FABRIC0->gate) & ~GATE_STATUS_LIVE) != gate ? 1u : 0u;
    wrong += adc_take_status(&FABRIC0->adc) != status || adc_status(&FABRIC0->adc) != flags ? 1u : 0u;
    return flags;
}

static void offsets(uint32_t a, uint32_t b, uint32_t c)
{
    adc_set_offsets(&FABRIC0->adc, (const uint32_t[3]){a, b, c});
}

/* ---- after reset ---- */

static void test_reset(void)
{
    harness_equal("limits: I_TRIP after reset", FABRIC0->adc.I_TRIP, NEVER);
    harness_equal("limits: SUM_TRIP after reset", FABRIC0->adc.SUM_TRIP, NEVER);
    harness_equal("limits: V_MIN after reset", FABRIC0->adc.V_MIN, 0u);
    harness_equal("limits: V_MAX after reset", FABRIC0->adc.V_MAX, NEVER);
    limits = (struct limits){NEVER, NEVER, 0, NEVER};
    uint32_t seen = 0;
    for (uint32_t n = 0; n < 4u; n++) {
        const uint32_t end = (n & 2u) == 0u ? 0u : 65535u;
        offsets(end, end, end);
        seen |= convert();
    }
    harness_equal("limits: nothing is beyond them, currents at either end", seen, 0u);
    harness_between("limits: they were there", (uint32_t)largest_of(&sample), 30000u, 32767u);
}

static void test_registers(void)
{
    adc_set_limits(&FABRIC0->adc, 0x11111, 0x02222, 0x13333, 0x04444);
    harness_equal("limits: I_TRIP reads back", FABRIC0->adc.I_TRIP, 0x11111u);
    harness_equal("limits: SUM_TRIP", FABRIC0->adc.SUM_TRIP, 0x02222u);
    harness_equal("limits: V_MIN", FABRIC0->adc.V_MIN, 0x13333u);
    harness_equal("limits: V_MAX", FABRIC0->adc.V_MAX, 0x04444u);
    adc_set_limits(&FABRIC0->adc, -1, -1, -1, -1);
    harness_equal("limits: I_TRIP has 17 bits", FABRIC0->adc.I_TRIP, 0x1FFFFu);
    harness_equal("limits: SUM_TRIP has", FABRIC0->adc.SUM_TRIP, 0x1FFFFu);
    harness_equal("limits: V_MIN has", FABRIC0->adc.V_MIN, 0x1FFFFu);
    harness_equal("limits: V_MAX has", FABRIC0->adc.V_MAX, 0x1FFFFu);
    no_limits();
}

/* ---- flags ---- */

struct coverage {
    uint32_t at, beyond, below;
};

/* How a value lay to its limit; `step` is the smallest distance there is. */
static void cover(struct coverage *c, int32_t value, int32_t limit, int32_t step)
{
    c->at += value == limit ? 1u : 0u;
    c->beyond += value > limit && value <= limit + step ? 1u : 0u;
    c->below += value < limit && value >= limit - step ? 1u : 0u;
}

static void report(const char *name, const struct coverage *c)
{
    harness_true(name, c->at > 0u && c->beyond > 0u && c->below > 0u);
}

/* Currents of all sizes and signs, limits a code below, at and a code above what there was before. */
static void test_boundaries(void)
{
    struct coverage current = {0, 0, 0};
    struct coverage sum = {0, 0, 0};
    struct coverage low = {0, 0, 0};
    struct coverage high = {0, 0, 0};
    uint32_t flags_seen = 0;
    uint32_t sums_once = 0;
    for (uint32_t n = 0; n < 600u; n++) {
        if (n % 20u == 0u) {
            offsets(n * 7919u % 65536u, n * 104729u % 65536u, n * 1299709u % 65536u);
            (void)convert();
        }
        const int32_t away = (int32_t)(n % 3u) - 1;
        set_limits(largest_of(&sample) + away * CODE, sum_of(&sample) + away * CODE,
                   sample.vbus_q15 + away * VOLTAGE_CODE, sample.vbus_q15 - away * VOLTAGE_CODE);
        const uint32_t flags = convert();
        flags_seen |= flags;
        sums_once += sum_was_off && (flags & ADC_STATUS_SUM) == 0u ? 1u : 0u;
        cover(&current, largest_of(&sample), limits.i_trip, CODE);
        cover(&sum, sum_of(&sample), limits.sum_trip, CODE);
        cover(&low, sample.vbus_q15, limits.v_min, VOLTAGE_CODE);
        cover(&high, sample.vbus_q15, limits.v_max, VOLTAGE_CODE);
    }
    harness_equal("flags: as the results of each conversion demand", wrong, 0u);
    harness_equal("flags: LIMIT in the gate's status if there is any, and nothing else", wrong_mirrors, 0u);
    harness_equal("flags: one conversion at a time", missing, 0u);
    harness_equal("flags: each was set", flags_seen, FLAGS);
    harness_true("flags: some sums were off only once", sums_once > 0u);
    report("flags: currents at I_TRIP and a code to either side", &current);
    report("flags: sums at SUM_TRIP and a code to either side", &sum);
    report("flags: voltages at V_MIN and a code to either side", &low);
    report("flags: voltages at V_MAX and a code to either side", &high);
}

/* One flag alone: set by its limit, shown beside LIVE, not to be cleared, gone with the next conversion without it. */
static void test_flag(const char *name, uint32_t flag, const struct limits *l)
{
    no_limits();
    (void)convert();
    set_limits(l->i_trip, l->sum_trip, l->v_min, l->v_max);
    harness_equal("flags: limits leave those of the results there are", adc_status(&FABRIC0->adc), 0u);
    (void)convert();
    (void)convert();
    harness_equal(name, adc_status(&FABRIC0->adc), flag);
    FABRIC0->adc.STATUS = UINT32_MAX;
    FABRIC0->gate.STATUS = UINT32_MAX;
    harness_equal("flags: not cleared by writing", adc_status(&FABRIC0->adc), flag);
    harness_equal("flags: LIMIT while off", gate_status(&FABRIC0->gate), GATE_STATUS_LIMIT);
    harness_true("flags: LIMIT does not hold back LIVE", gate_enable(&FABRIC0->gate));
    harness_equal("flags: nor take it away", gate_status(&FABRIC0->gate), GATE_STATUS_LIVE | GATE_STATUS_LIMIT);
    (void)convert();
    harness_equal("flags: not at the next conversion either", gate_status(&FABRIC0->gate),
                  GATE_STATUS_LIVE | GATE_STATUS_LIMIT);
    no_limits();
    harness_equal("flags: they stay while there is no other conversion", adc_status(&FABRIC0->adc), flag);
    (void)convert();
    harness_equal("flags: gone with the next", gate_status(&FABRIC0->gate), GATE_STATUS_LIVE);
    gate_disable(&FABRIC0->gate);
}

static void test_flags(void)
{
    const uint32_t nominal = BOARD_ADC_OFFSET_NOMINAL;
    const struct limits i_trip = {4000, NEVER, 0, NEVER};
    const struct limits sum_trip = {NEVER, 4000, 0, NEVER};
    offsets(nominal - 8000u, nominal, nominal + 8000u);
    test_flag("flags: a current beyond I_TRIP", ADC_STATUS_CURRENT, &i_trip);
    offsets(nominal, nominal - 8000u, nominal);
    test_flag("flags: a sum beyond SUM_TRIP", ADC_STATUS_SUM, &sum_trip);
    offsets(nominal, nominal + 8000u, nominal);
    test_flag("flags: a negative one", ADC_STATUS_SUM, &sum_trip);
    offsets(nominal, nominal, nominal);
    (void)convert();
    const struct limits v_max = {NEVER, NEVER, 0, sample.vbus_q15 / 2};
    const struct limits v_min = {NEVER, NEVER, NEVER, NEVER};
    if (harness_true("flags: there is a bus voltage", sample.vbus_q15 > 0)) {
        test_flag("flags: a voltage above V_MAX", ADC_STATUS_VBUS_HIGH, &v_max);
    }
    test_flag("flags: a voltage below V_MIN", ADC_STATUS_VBUS_LOW, &v_min);
}

/* A sum that is off at every other conversion never counts. */
static void test_two_in_a_row(void)
{
    const uint32_t nominal = BOARD_ADC_OFFSET_NOMINAL;
    uint32_t alternating = 0;
    set_limits(NEVER, 4000, 0, NEVER);
    for (uint32_t n = 0; n < 6u; n++) {
        offsets(n % 2u == 0u ? nominal : nominal - 8000u, nominal, nominal);
        (void)convert();
        alternating |= adc_status(&FABRIC0->adc);
    }
    harness_equal("sum: off at every other conversion", alternating, 0u);
    (void)convert();
    harness_equal("sum: the second in a row", adc_status(&FABRIC0->adc), ADC_STATUS_SUM);
    adc_stop(&FABRIC0->adc);
    harness_equal("sum: the flag outlasts a stop", adc_status(&FABRIC0->adc), ADC_STATUS_SUM);
    offsets(nominal, nominal, nominal);
    (void)convert();
    harness_equal("sum: none", adc_status(&FABRIC0->adc), 0u);
    harness_equal("flags: all conversions as their results demand", wrong + wrong_mirrors + missing, 0u);
}

static const struct pwm_setup setup = {PERIOD_COUNTS / 2u, 50u, 10u, PWM_UPDATE_VALLEY, 0u};

int main(void)
{
    (void)harness_begin();
    mss_timer2_start_free_running();
    if (harness_true("limits: identity of the fabric", gate_id_ok(&FABRIC0->gate)) &&
        harness_true("limits: triggers come", pwm_init(&FABRIC0->pwm, &setup))) {
        test_reset();
        test_registers();
        test_boundaries();
        test_flags();
        test_two_in_a_row();
    }
    harness_end();
}

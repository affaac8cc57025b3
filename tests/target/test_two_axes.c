/* SPDX-License-Identifier: MIT */
/*
 * Two axes beside each other: everything of one motor stands in its struct axis, so that what one does must not be seen in the
 * other. Each has a fabric in RAM, whose sensors and encoder show a random walk of its own. Both run in turn, then each once
 * more by itself: at the end, and at every 1000th step on the way, all that either holds, and its fabric, is the same to the
 * bit. No axis has a name here: what links without `axes` cannot reach one behind its pointer's back.
 */
#include "drivers/mss/watchdog.h"
#include "firmware/control/current_loop_step.h"
#include "firmware/drive/drive.h"
#include "firmware/settings/config.h"
#include "tests/target/harness.h"
#include "tests/target/random.h"

#define STEPS   100000u /* of each current loop */
#define CHECKED 1000u
#define CHECKS  (STEPS / CHECKED)
#define COUNTS  4000u

struct station {
    struct axis axis;
    struct fabric fabric;
    uint32_t random;
    uint32_t steps;
    uint32_t live_steps, forced_steps; /* with the bridge on; of these, with a prescribed field */
    uint32_t faults;
};

static uint32_t next(struct station *s)
{
    return random_next(&s->random);
}

static uint32_t *word(struct station *s, size_t offset)
{
    return (uint32_t *)(void *)&s->fabric + offset / sizeof(uint32_t);
}

#define REGISTER(s, name) (*word((s), offsetof(struct fabric, name)))

/* What a fabric would do in a period: it converts, the shaft turns a little, the gates follow their switch. */
static void convert(struct station *s)
{
    REGISTER(s, adc.IA) = (uint32_t)((int32_t)(next(s) % 2001u) - 1000);
    REGISTER(s, adc.IB) = (uint32_t)((int32_t)(next(s) % 2001u) - 1000);
    REGISTER(s, adc.IC) = 0u - REGISTER(s, adc.IA) - REGISTER(s, adc.IB);
    REGISTER(s, adc.VBUS) = 16000u + next(s) % 64u;
    REGISTER(s, adc.STATUS) = ADC_STATUS_EOC;
    REGISTER(s, adc.SEQUENCE)++;
    REGISTER(s, encoder.LATCH_TIME) += CONFIG_PWM_COUNTS;
    if (next(s) % 8u == 0u) {
        REGISTER(s, encoder.LATCHED) = (REGISTER(s, encoder.LATCHED) + next(s) % 3u + COUNTS - 1u) % COUNTS;
        REGISTER(s, encoder.EDGE_TIME) = REGISTER(s, encoder.LATCH_TIME) - next(s) % CONFIG_PWM_COUNTS;
    }
    REGISTER(s, gate.STATUS) = REGISTER(s, gate.CONTROL) & GATE_STATUS_LIVE;
}

static void begin(struct station *s, uint32_t seed)
{
    uint32_t *const words = (uint32_t *)(void *)s;
    for (size_t n = 0; n < sizeof *s / sizeof *words; n++) {
        words[n] = 0;
    }
    s->random = seed;
    for (size_t n = 0; n < 3u; n++) {
        word(s, offsetof(struct fabric, adc.OFFSET_A))[n] = BOARD_ADC_OFFSET_NOMINAL;
    }
    drive_init(&s->axis, &s->fabric);
    drive_start(&s->axis, FAULT_NONE);
}

/* A period of the current loop and, when it is due, the slow loop; and a user who switches on again whatever ended. */
static void step(struct station *s)
{
    struct axis *const a = &s->axis;
    convert(s);
    if (current_loop_step(&a->loop, &s->fabric, (enum loop_source)a->loop.source)) {
        drive_sample_fault(a);
    }
    s->steps++;
    s->live_steps += s->fabric.gate.STATUS & GATE_STATUS_LIVE;
    s->forced_steps += a->loop.source == LOOP_FORCED ? s->fabric.gate.STATUS & GATE_STATUS_LIVE : 0u;
    if (s->steps % CONFIG_PERIODS_PER_SLOW != 0u) {
        return;
    }
    drive_step(a);
    s->faults += a->state == AXIS_FAULT ? 1u : 0u;
    if (a->state == AXIS_FAULT) {
        a->request = AXIS_REQUEST_CLEAR; /* the request's own check wants bits that go when a 1 is written */
    } else if (a->state == AXIS_SWITCH_ON_DISABLED) {
        (void)drive_switch_on(a);
        while (drive_prepare(a)) {
        }
    } else if (a->state == AXIS_OPERATION_ENABLED) {
        (void)drive_command_speed(a, (int32_t)(next(s) % 500u));
    }
}

static uint32_t checksum(const struct station *s)
{
    const uint32_t *const words = (const uint32_t *)(const void *)s;
    uint32_t sum = 0;
    for (size_t n = 0; n < sizeof *s / sizeof *words; n++) {
        sum = (sum << 5 | sum >> 27) ^ words[n];
    }
    return sum;
}

/* Runs the stations that are given, in turn, and notes what each has come to. */
static void run(struct station *const stations[], uint32_t count, uint32_t sums[][CHECKS])
{
    for (uint32_t n = 0; n < STEPS; n++) {
        for (uint32_t i = 0; i < count; i++) {
            step(stations[i]);
            if ((n + 1u) % CHECKED == 0u) {
                sums[i][n / CHECKED] = checksum(stations[i]);
            }
        }
        watchdog_refresh();
    }
}

static uint32_t differences(const uint32_t *x, const uint32_t *y)
{
    uint32_t count = 0;
    for (uint32_t n = 0; n < CHECKS; n++) {
        count += x[n] != y[n] ? 1u : 0u;
    }
    return count;
}

/* The same memory for both runs: pointers are part of what is compared. */
static struct station first, second;
static uint32_t together[2][CHECKS], alone[2][CHECKS];

int main(void)
{
    static const uint32_t seeds[2] = {RANDOM_SEED, 0x1234567u};
    struct station *const both[2] = {&first, &second};

    harness_begin();
    begin(&first, seeds[0]);
    begin(&second, seeds[1]);
    run(both, 2u, together);
    harness_true("they are two", differences(together[0], together[1]) > CHECKS / 2u);
    begin(&first, seeds[0]);
    run(&both[0], 1u, &alone[0]);
    begin(&second, seeds[1]);
    run(&both[1], 1u, &alone[1]);
    harness_equal("the first, beside the second and alone", differences(together[0], alone[0]), 0u);
    harness_equal("the second, beside the first and alone", differences(together[1], alone[1]), 0u);
    harness_note("faults of the first", first.faults);
    harness_note("and the last of them", first.axis.faults.cause);
    harness_between("steps with the bridge on, the first", first.live_steps, STEPS / 10u, STEPS);
    harness_between("and the second", second.live_steps, STEPS / 10u, STEPS);
    harness_between("steps of its alignment, the first", first.forced_steps, STEPS / 10u, STEPS);
    harness_between("and the second", second.forced_steps, STEPS / 10u, STEPS);
    harness_end();
}

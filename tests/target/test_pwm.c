/* SPDX-License-Identifier: MIT */
/* The driver of the PWM: what it refuses, its modes, and where the triggers stand; of the registers, tests/twin/test_pwm.py. */
#include "tests/target/fabric_bench.h"

static bool refused(struct pwm_setup wrong)
{
    return !pwm_init(&FABRIC0->pwm, &wrong) && FABRIC0->pwm.CONTROL == 0u;
}

static void test_pwm_init(void)
{
    struct pwm_regs *const pwm = &FABRIC0->pwm;
    const struct pwm_setup setup = fabric_bench_setup();
    harness_true("pwm: refuses a period too short", refused((struct pwm_setup){PWM_HALF_MIN - 1u, 5u, 1u, 0u, 0u}));
    harness_true("pwm: refuses a period over 16 bits",
                 refused((struct pwm_setup){PWM_HALF_MAX + 1u, 50u, 10u, 0u, 0u}));
    harness_true("pwm: refuses no dead time", refused((struct pwm_setup){2500u, 0u, 10u, 0u, 0u}));
    harness_true("pwm: refuses a dead time over 8 bits", refused((struct pwm_setup){2500u, 256u, 10u, 0u, 0u}));
    harness_true("pwm: refuses one that takes all", refused((struct pwm_setup){50u, 50u, 10u, 0u, 0u}));
    harness_true("pwm: refuses no shortest pulse", refused((struct pwm_setup){2500u, 50u, 0u, 0u, 0u}));
    harness_true("pwm: refuses one over 8 bits", refused((struct pwm_setup){2500u, 50u, 256u, 0u, 0u}));
    harness_true("pwm: refuses a mode there is not", refused((struct pwm_setup){2500u, 50u, 10u, 4u, 0u}));
    harness_true("pwm: refuses to be ahead by more than half a period",
                 refused((struct pwm_setup){2500u, 50u, 10u, 0u, 2501u}));
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

static bool waits(void)
{
    return (FABRIC0->pwm.STATUS & PWM_STATUS_WAITING) != 0u;
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

int main(void)
{
    if (fabric_bench_begin()) {
        test_pwm_init();
        test_pwm_modes();
        test_pwm_goes_on();
        test_early_triggers();
    }
    harness_end();
}

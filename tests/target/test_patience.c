/* SPDX-License-Identifier: MIT */
/*
 * What the measurements at standstill wait for, on registers that stand still: how long they wait shows whether they do. A wait
 * that is for nothing ends by its patience, a PWM period's clocks in reads.
 */
#include "firmware/commission/pulses.h"
#include "firmware/control/current_loop.h"
#include "tests/target/harness.h"
#include "tests/target/waiting.h"

#define HALF_COUNTS 2500u
#define DEAD_COUNTS 50u
#define POLLS       (2u * HALF_COUNTS)
#define POLL_TICKS  2u /* at least: a read and a branch */

static struct current_loop unlocked;
static struct fabric still;

static uint32_t pulse_ticks(uint32_t status, uint32_t count)
{
    const uint32_t start = mss_timer2_now();
    still.pwm.PERIOD = HALF_COUNTS;
    still.pwm.DEAD = DEAD_COUNTS;
    *(volatile uint32_t *)&still.pwm.STATUS = status;
    *(volatile uint32_t *)&still.pwm.COUNT = count;
    (void)emf_pulse(&unlocked, &still, EMF_PULSE_MIN);
    return mss_timer2_now() - start;
}

/* Half a dead time behind the valley the sample is taken; not before a count more the gates may close. */
static void test_pulse_lasts_until_the_sample(void)
{
    const uint32_t sample_at = HALF_COUNTS - DEAD_COUNTS / 2u;
    const uint32_t past = pulse_ticks(0u, sample_at - 1u);
    harness_between("pulse: the count of the sample is waited for", pulse_ticks(0u, sample_at) - past,
                    POLL_TICKS * POLLS, 100u * POLLS);
    harness_between("pulse: one before it as well", pulse_ticks(0u, sample_at + 1u) - past, POLL_TICKS * POLLS,
                    100u * POLLS);
    harness_between("pulse: farther on nothing is", pulse_ticks(0u, sample_at - 9u), past - 100u, past + 100u);
    harness_equal("pulse: the gates are off", still.gate.CONTROL, 0u);
}

/*
 * On its way up: first the middle of that is waited for, from where the longest pulse could begin, with a dead time and a
 * margin to either side; then the place from which this pulse lasts until the sample.
 */
static void test_pulse_begins_in_time(void)
{
    const uint32_t middle = HALF_COUNTS / 2u + DEAD_COUNTS;
    const uint32_t begins = HALF_COUNTS + DEAD_COUNTS / 2u - EMF_PULSE_MIN;
    const uint32_t open = pulse_ticks(PWM_STATUS_RISING, begins);
    harness_between("pulse: it begins where it lasts until the sample",
                    pulse_ticks(PWM_STATUS_RISING, begins - 1u) - open, POLL_TICKS * POLLS, 100u * POLLS);
    const uint32_t late = pulse_ticks(PWM_STATUS_RISING, middle);
    harness_between("pulse: behind the middle of the way it is held for that", late,
                    pulse_ticks(PWM_STATUS_RISING, begins - 1u) - 100u,
                    pulse_ticks(PWM_STATUS_RISING, begins - 1u) + 100u);
    harness_between("pulse: before it interrupts may still come", pulse_ticks(PWM_STATUS_RISING, middle - 1u) - late,
                    POLL_TICKS * POLLS, 100u * POLLS);
}

static uint32_t burst_ticks(uint32_t status)
{
    static struct current_loop loop;
    static struct burst burst;
    const uint32_t start = mss_timer2_now();
    still.adc.STATUS = status;
    burst = (struct burst){.v_steps = 10, .hold = 1};
    burst_play(&burst, &loop, &still.adc);
    return mss_timer2_now() - start;
}

/* A sample has ended, and its interrupt is still to come: the voltage stays as it is until then. */
static void test_burst_waits_for_the_interrupt(void)
{
    const uint32_t served = burst_ticks(0u);
    harness_between("burst: each sample's interrupt is waited for", burst_ticks(ADC_STATUS_EOC) - served,
                    BURST_SAMPLES * POLL_TICKS * POLLS, BURST_SAMPLES * 100u * POLLS);
    harness_between("burst: no other bit is", burst_ticks(ADC_STATUS_OVERRUN), served - 1000u, served + 1000u);
}

int main(void)
{
    (void)harness_begin();
    waiting_begin();
    test_pulse_lasts_until_the_sample();
    test_pulse_begins_in_time();
    test_burst_waits_for_the_interrupt();
    harness_end();
}

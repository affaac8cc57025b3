/* SPDX-License-Identifier: MIT */
#include "drivers/fabric/pwm.h"

#define EIGHT_BITS 255u

static bool fits(const struct pwm_setup *s)
{
    return s->half_counts >= PWM_HALF_MIN && s->half_counts <= PWM_HALF_MAX && s->dead_counts - 1u < EIGHT_BITS &&
           s->min_pulse_counts - 1u < EIGHT_BITS && s->dead_counts < s->half_counts &&
           s->ahead_counts <= s->half_counts;
}

/* The carrier rests a clock behind its switch; a read takes longer, except where the fabric's clock is slow. */
#define POLLS 16u

static bool comes_to_rest(struct pwm_regs *pwm)
{
    pwm->CONTROL = 0u;
    for (uint32_t poll = 0; poll < POLLS; poll++) {
        if ((pwm->STATUS & PWM_STATUS_RUNNING) == 0u) {
            return true;
        }
    }
    return false;
}

/* Reading back finds another design. */
static bool holds(volatile uint32_t *reg, uint32_t value)
{
    *reg = value;
    return *reg == value;
}

/* Before or behind an end of the carrier the count is as far from it; what it comes to is the direction. */
static uint32_t valley_trigger(uint32_t half_counts, uint32_t behind, uint32_t early)
{
    return behind >= early ? (half_counts - (behind - early)) | PWM_TRIGGER_FALLING
                           : (half_counts - (early - behind)) | PWM_TRIGGER_RISING;
}

static uint32_t peak_trigger(uint32_t behind, uint32_t early)
{
    return behind >= early ? (behind - early) | PWM_TRIGGER_RISING : (early - behind) | PWM_TRIGGER_FALLING;
}

static bool set_up(struct pwm_regs *pwm, const struct pwm_setup *s)
{
    const uint32_t trigger = valley_trigger(s->half_counts, s->dead_counts / 2u, 0u);
    return holds(&pwm->PERIOD, s->half_counts) && holds(&pwm->DEAD, s->dead_counts) &&
           holds(&pwm->MIN_PULSE, s->min_pulse_counts) && holds(&pwm->MODE, (uint32_t)s->update) &&
           holds(&pwm->PHASE, s->half_counts - s->ahead_counts) && holds(&pwm->TRIGGER_1, trigger) &&
           holds(&pwm->TRIGGER_2, 0u);
}

bool pwm_init(struct pwm_regs *pwm, const struct pwm_setup *setup)
{
    if (!comes_to_rest(pwm) || !fits(setup) || !set_up(pwm, setup)) {
        return false;
    }
    pwm->COMPARE_A = setup->half_counts / 2u;
    pwm->COMPARE_B = setup->half_counts / 2u;
    pwm->COMPARE_C = setup->half_counts / 2u;
    return holds(&pwm->CONTROL, setup->ahead_counts == 0u ? PWM_CONTROL_RUN : PWM_CONTROL_RUN | PWM_CONTROL_FOLLOW);
}

/* So far from either end neither a trigger nor a turn comes between looking and stopping. */
#define END_COUNTS 256u
#define END_POLLS  128u

/* Where the carrier is, as PHASE wants it; if it does not move, the valley. */
static uint32_t position(const struct pwm_regs *pwm)
{
    const uint32_t half_counts = pwm->PERIOD;
    for (uint32_t poll = 0; poll < END_POLLS; poll++) {
        const uint32_t rising = pwm->STATUS & PWM_STATUS_RISING;
        const uint32_t count = pwm->COUNT;
        if (count > END_COUNTS && count + END_COUNTS < half_counts) {
            return rising == 0u ? count : count | PWM_PHASE_RISING;
        }
    }
    return half_counts;
}

bool pwm_set_update(struct pwm_regs *pwm, enum pwm_update update)
{
    const uint32_t follow = pwm->CONTROL & PWM_CONTROL_FOLLOW;
    if (follow == 0u && pwm->MODE == (uint32_t)update) {
        return true;
    }
    const uint32_t from = follow != 0u ? pwm->PHASE : position(pwm);
    return comes_to_rest(pwm) && holds(&pwm->MODE, (uint32_t)update) && holds(&pwm->PHASE, from) &&
           holds(&pwm->CONTROL, PWM_CONTROL_RUN | follow);
}

bool pwm_set_samples(struct pwm_regs *pwm, uint32_t samples, uint32_t early_counts)
{
    const uint32_t behind = pwm->DEAD / 2u;
    return holds(&pwm->TRIGGER_1, valley_trigger(pwm->PERIOD, behind, early_counts)) &&
           holds(&pwm->TRIGGER_2, samples == 2u ? peak_trigger(behind, early_counts) : 0u);
}

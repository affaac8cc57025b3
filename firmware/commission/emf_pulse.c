/* SPDX-License-Identifier: MIT */
#include "firmware/commission/emf_pulse.h"

#include "drivers/cortex/cpu.h"
#include "firmware/control/bridge.h"
#include "firmware/settings/config.h"

/* A PWM period has more clocks than reads of the fabric. */
#define PATIENCE_POLLS CONFIG_PWM_COUNTS

#define MARGIN_COUNTS 32u /* to the edge before */

static uint32_t longest_of(uint32_t half_counts, uint32_t dead_counts)
{
    return half_counts / 2u - dead_counts - MARGIN_COUNTS;
}

uint32_t emf_pulse_longest(const struct pwm_regs *pwm)
{
    return longest_of(pwm->PERIOD, pwm->DEAD);
}

/*
 * Waits until the carrier has risen to this count, on its way to the valley, or has fallen to it from there. To rise it must
 * not begin before the peak.
 */
static inline void wait_carrier(const struct pwm_regs *pwm, bool rising, uint32_t count)
{
    for (uint32_t poll = 0; poll < PATIENCE_POLLS; poll++) {
        if (((pwm->STATUS & PWM_STATUS_RISING) != 0u) == rising &&
            (rising ? pwm->COUNT >= count : pwm->COUNT <= count)) {
            return;
        }
    }
}

static void wait_conversion(const struct adc_regs *adc, uint32_t before)
{
    for (uint32_t poll = 0; poll < PATIENCE_POLLS && adc_sequence(adc) == before; poll++) {
    }
}

struct emf_pulse emf_pulse(const volatile struct current_loop *c, struct fabric *f, uint32_t counts)
{
    const uint32_t half_counts = f->pwm.PERIOD;
    const uint32_t behind = f->pwm.DEAD / 2u; /* distance of the sample from the valley: pwm_init() */
    wait_carrier(&f->pwm, false, UINT32_MAX);
    wait_carrier(&f->pwm, true, half_counts - longest_of(half_counts, 2u * behind) - MARGIN_COUNTS);
    const uint32_t mask = cpu_irq_save();
    const uint32_t before = adc_sequence(&f->adc);
    wait_carrier(&f->pwm, true, half_counts + behind - counts);
    (void)bridge_enable(c, f);
    wait_carrier(&f->pwm, false, half_counts - behind - 1u);
    gate_disable(&f->gate);
    wait_conversion(&f->adc, before);
    const struct adc_sample s = adc_read(&f->adc);
    cpu_irq_restore(mask);
    return (struct emf_pulse){.sequence = adc_sequence(&f->adc), .i = clarke_q15(s.ia_q15, s.ib_q15)};
}

struct emf_pulse emf_pulse_period(const volatile struct current_loop *c, struct fabric *f, uint32_t samples)
{
    emf_pulse_wait(f, 1u);
    (void)bridge_enable(c, f);
    emf_pulse_wait(f, samples);
    gate_disable(&f->gate);
    const struct adc_sample s = adc_read(&f->adc);
    return (struct emf_pulse){.sequence = adc_sequence(&f->adc), .i = clarke_q15(s.ia_q15, s.ib_q15)};
}

void emf_pulse_wait(const struct fabric *f, uint32_t samples)
{
    for (uint32_t n = 0; n < samples; n++) {
        (void)adc_read_next(&f->adc, PATIENCE_POLLS);
    }
}

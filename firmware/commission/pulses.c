/* SPDX-License-Identifier: MIT */
#include "firmware/commission/pulses.h"

#include "drivers/cortex/cpu.h"
#include "firmware/control/bridge.h"
#include "firmware/settings/config.h"
#include "lib/pi.h"
#include "lib/transform_q15.h"
#include "lib/trig.h"

/* A PWM period has more clocks than reads of the fabric. */
#define TIMEOUT_POLLS CONFIG_PWM_COUNTS

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
 * Waits until the carrier has risen to this count, before the valley, or has fallen to it after that. To rise it must be called
 * after the peak.
 */
static inline void wait_carrier(const struct pwm_regs *pwm, bool rising, uint32_t count)
{
    for (uint32_t poll = 0; poll < TIMEOUT_POLLS; poll++) {
        if (((pwm->STATUS & PWM_STATUS_RISING) != 0u) == rising &&
            (rising ? pwm->COUNT >= count : pwm->COUNT <= count)) {
            return;
        }
    }
}

static void wait_conversion(const struct adc_regs *adc, uint32_t before)
{
    for (uint32_t poll = 0; poll < TIMEOUT_POLLS && adc_sequence(adc) == before; poll++) {
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
        (void)adc_read_next(&f->adc, TIMEOUT_POLLS);
    }
}

/* ==== bursts, bridge on ==== */

int32_t burst_sign(const struct burst *b, int32_t k)
{
    const int32_t quarter = (k / b->hold) & 3;
    return quarter == 0 || quarter == 3 ? 1 : -1;
}

/* Waits for the next sample, and until its interrupt is over: voltages set from here on are for the sample after it. */
static struct adc_sample next_sample(const struct adc_regs *adc)
{
    const struct adc_sample sample = adc_read_next(adc, TIMEOUT_POLLS);
    for (int32_t poll = 0; poll < TIMEOUT_POLLS && (adc_status(adc) & ADC_STATUS_EOC) != 0u; poll++) {
    }
    return sample;
}

void burst_play(struct burst *b, volatile struct current_loop *c, const struct adc_regs *adc)
{
    const cossin_t wave = cossin_q15(b->angle_q32 - b->field_q32);
    const int32_t wave_d_q9 = ((b->v_steps * wave.cos) >> 15) * (1 << PI_SHIFT);
    const int32_t wave_q_q9 = ((b->v_steps * wave.sin) >> 15) * (1 << PI_SHIFT);
    const int32_t kp_d_q9 = c->kp_d_q9, kp_q_q9 = c->kp_q_q9, ki_q15 = c->ki_q15;
    current_loop_gains(c, 0, 0, 0); /* from here on the integrals are constant */
    const int32_t steady_d_q9 = c->integral_d_q9, steady_q_q9 = c->integral_q_q9;
    for (int32_t k = 0; k < BURST_SAMPLES; k++) {
        const struct adc_sample sample = next_sample(adc);
        const int32_t sign = k < BURST_LENGTH ? burst_sign(b, k) : 0; /* at the end the integrals are restored */
        current_loop_hold(c, steady_d_q9 + sign * wave_d_q9, steady_q_q9 + sign * wave_q_q9);
        const uint32_t angle_q32 = b->angle_q32 + (uint32_t)k * (uint32_t)b->turn_q32;
        const dq_t i = park_q15(clarke_q15(sample.ia_q15, sample.ib_q15), cossin_q15(angle_q32));
        b->i_d_q15[k] = (int16_t)q15_sat16(i.d);
        b->i_q_q15[k] = (int16_t)q15_sat16(i.q);
    }
    current_loop_gains(c, kp_d_q9, kp_q_q9, ki_q15);
}

int32_t burst_room_steps(const volatile struct current_loop *c)
{
    const int32_t held_steps = (q15_abs(c->integral_d_q9) + q15_abs(c->integral_q_q9)) >> PI_SHIFT;
    return q15_max(LOOP_V_D_MAX_STEPS - held_steps, 1);
}

int32_t burst_peak_q15(const struct burst *b)
{
    int32_t peak_q15 = 0;
    for (int32_t k = BURST_LAG; k < BURST_SAMPLES; k++) {
        peak_q15 = q15_max(peak_q15, q15_abs(b->i_d_q15[k] - b->i_d_q15[BURST_LAG]));
    }
    return peak_q15;
}

void burst_add(struct burst_sums *s, const struct burst *b, int32_t vbus_q15)
{
    const int32_t zero_q15 = b->i_d_q15[BURST_LAG]; /* the steady current is not part of the wave */
    for (int32_t k = 0; k < BURST_LENGTH; k++) {
        const int32_t sign = burst_sign(b, k);
        const int32_t before_q15 = b->i_d_q15[k + BURST_LAG] - zero_q15;
        const int32_t change_d_q15 = b->i_d_q15[k + BURST_LAG + 1] - b->i_d_q15[k + BURST_LAG];
        const int32_t change_q_q15 = b->i_q_q15[k + BURST_LAG + 1] - b->i_q_q15[k + BURST_LAG];
        s->ui += sign * before_q15;
        s->ud += sign * change_d_q15;
        s->uq += sign * change_q_q15;
        s->ii += before_q15 * before_q15;
        s->id += before_q15 * change_d_q15;
    }
    s->count += BURST_LENGTH;
    s->vbus_q15 += vbus_q15;
    s->bursts++;
}

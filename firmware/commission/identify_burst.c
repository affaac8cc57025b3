/* SPDX-License-Identifier: MIT */
#include "firmware/commission/identify_burst.h"

#include "lib/pi.h"
#include "lib/transform_q15.h"
#include "lib/trig.h"

/* Reads of the fabric within a sample's time are fewer than its clocks. */
#define PATIENCE_POLLS CONFIG_PWM_COUNTS

int32_t burst_sign(const struct burst *b, int32_t k)
{
    const int32_t quarter = (k / b->hold) & 3;
    return quarter == 0 || quarter == 3 ? 1 : -1;
}

/* The next sample, and the interrupt that it brings is over: what is held from here on is for the one after it. */
static struct adc_sample next_sample(const struct adc_regs *adc)
{
    const struct adc_sample sample = adc_read_next(adc, PATIENCE_POLLS);
    for (int32_t poll = 0; poll < PATIENCE_POLLS && (adc_status(adc) & ADC_STATUS_EOC) != 0u; poll++) {
    }
    return sample;
}

void burst_play(struct burst *b, volatile struct current_loop *c, const struct adc_regs *adc)
{
    const cossin_t wave = cossin_q15(b->angle_q32 - b->field_q32);
    const int32_t wave_d_q9 = ((b->v_steps * wave.cos) >> 15) * (1 << PI_SHIFT);
    const int32_t wave_q_q9 = ((b->v_steps * wave.sin) >> 15) * (1 << PI_SHIFT);
    const int32_t kp_d_q9 = c->kp_d_q9, kp_q_q9 = c->kp_q_q9, ki_q15 = c->ki_q15;
    current_loop_gains(c, 0, 0, 0); /* from here on the integrals stand */
    const int32_t steady_d_q9 = c->integral_d_q9, steady_q_q9 = c->integral_q_q9;
    for (int32_t k = 0; k < BURST_SAMPLES; k++) {
        const struct adc_sample sample = next_sample(adc);
        const int32_t sign = k < BURST_LENGTH ? burst_sign(b, k) : 0; /* at the end they are what they were */
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

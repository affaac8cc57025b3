/* SPDX-License-Identifier: MIT */
/* The source of the current loop itself, with what it exports under other names. */
#define current_loop          staged_loop
#define current_loop_tune     staged_tune
#define current_loop_start    staged_start
#define current_loop_prepare  staged_prepare
#define FabricIrq0_IRQHandler staged_handler

#include "tests/bench/stages.h"
#include "firmware/current_loop.c"

/* What passes from stage to stage. */
static struct {
    struct adc_sample sample;
    uint32_t position, adc_flags;
    int32_t w_q15;
    uint32_t angle_q32;
    dq_t i, v;
    cossin_t cs;
} between;

struct current_loop *stages_state(void)
{
    return &current_loop;
}

void stage_fetch(void)
{
    between.sample = adc_read();
    between.position = encoder_latched();
    between.adc_flags = adc_acknowledge();
}

void stage_scale(void)
{
    struct current_loop *const c = &current_loop;
    c->i_q15.a = current_q15(between.sample.ia, c->offset_q4[0]);
    c->i_q15.b = current_q15(between.sample.ib, c->offset_q4[1]);
    c->i_q15.c = current_q15(between.sample.ic, c->offset_q4[2]);
    c->vbus_q15 = (int32_t)(between.sample.vbus << 3);
    c->vbus_recip_q14 = recip_q14_refine(c->vbus_recip_q14, q15_max(c->vbus_q15, c->v_min_q15));
}

void stage_observe(void)
{
    struct current_loop *const c = &current_loop;
    pll_step(&c->pll, between.position * c->encoder_scale_q32);
    between.w_q15 = current_loop_w_q15();
    between.angle_q32 = (c->pll.angle_q32 & c->encoder_mask) + c->angle_offset_q32;
}

void stage_transform(void)
{
    struct current_loop *const c = &current_loop;
    between.i = park_q15(clarke_q15(c->i_q15.a, c->i_q15.b), cossin_q15(between.angle_q32 >> 16));
}

void stage_regulate(void)
{
    between.v = regulate(&current_loop, between.i, between.w_q15);
}

void stage_advance(void)
{
    const int32_t speed_q32 = current_loop.pll.speed_q32;
    const uint32_t advance_q32 = ((uint32_t)speed_q32 + (uint32_t)(speed_q32 >> 1)) & current_loop.encoder_mask;
    between.cs = cossin_q15((between.angle_q32 + advance_q32) >> 16);
}

void stage_modulate(void)
{
    modulate(&current_loop, between.v, between.i, between.cs);
}

void stage_publish(void)
{
    struct current_loop *const c = &current_loop;
    c->i_d_q15 = between.i.d;
    c->i_q_q15 = between.i.q;
    c->v_d_q15 = between.v.d;
    c->v_q_q15 = between.v.q;
    c->angle_u16 = between.angle_q32 >> 16;
    c->samples++;
}

void stage_protect(void)
{
    struct current_loop *const c = &current_loop;
    const uint32_t gate_flags = gate_status();
    const uint32_t raised = trips(c, between.w_q15, encoder_status()) & c->armed;
    if ((raised | (gate_flags & GATE_STATUS_LATCHES)) != 0u) {
        trip(raised, gate_flags);
    } else if ((between.adc_flags & ADC_STATUS_OVERRUN) != 0u && c->armed != 0u) {
        fault_raise(FAULT_LOOP_OVERRUN);
    }
}

void stage_write_pwm(void)
{
    const uint32_t on_counts_any = between.position;
    corepwm_write_legs(on_counts_any, on_counts_any, on_counts_any, CONFIG_DEAD_COUNTS, CONFIG_PWM_COUNTS);
}

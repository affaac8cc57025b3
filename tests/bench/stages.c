/* SPDX-License-Identifier: MIT */
/* The source of the current loop itself, with what it exports under other names. */
#define current_loop          staged_loop
#define current_loop_tune     staged_tune
#define current_loop_start    staged_start
#define current_loop_prepare  staged_prepare
#define FabricIrq0_IRQHandler staged_handler

#include "tests/bench/stages.h"
#include "drivers/cortex/cpu.h"
#include "firmware/current_loop.c"

/* Has the value ready here, and not later. */
#define READY(value) __asm volatile("" : "+r"(value))

/* One more than there are stages: the last pair has one NOP between its readings. */
static uint32_t readings[STAGE_COUNT + 2];

static inline __attribute__((always_inline)) void read_before(uint32_t stage)
{
    cpu_compiler_barrier();
    readings[stage] = dwt_cycles();
    cpu_compiler_barrier();
}

struct current_loop *stages_state(void)
{
    return &current_loop;
}

static inline __attribute__((always_inline)) void protect(struct current_loop *c, int32_t w_q15, uint32_t adc_flags)
{
    const uint32_t gate_flags = gate_status();
    const uint32_t raised = trips(c, w_q15, encoder_status()) & c->armed;
    if ((raised | (gate_flags & GATE_STATUS_LATCHES)) != 0u) {
        trip(raised, gate_flags);
    } else if ((adc_flags & ADC_STATUS_OVERRUN) != 0u && c->armed != 0u) {
        fault_raise(FAULT_LOOP_OVERRUN);
    }
}

/* The body of the interrupt's handler in firmware/current_loop.c, statement by statement. */
static __attribute__((noinline)) void run(void)
{
    struct current_loop *const c = &current_loop;

    read_before(STAGE_FETCH);
    struct adc_sample sample = adc_read();
    uint32_t position = encoder_latched();
    uint32_t adc_flags = adc_take_status();

    read_before(STAGE_SCALE);
    c->i_q15.a = sample.ia_q15;
    c->i_q15.b = sample.ib_q15;
    c->i_q15.c = sample.ic_q15;
    c->vbus_q15 = sample.vbus_q15;
    c->vbus_recip_q14 = recip_q14_refine(c->vbus_recip_q14, q15_max(c->vbus_q15, c->v_min_q15));

    read_before(STAGE_OBSERVE);
    pll_step(&c->pll, position * c->encoder_scale_q32);
    int32_t speed_q32 = c->pll.speed_q32;
    int32_t w_q15 = current_loop_w_q15();
    uint32_t angle_q32 = (c->pll.angle_q32 & c->encoder_mask) + c->angle_offset_q32;
    READY(w_q15);
    READY(angle_q32);

    read_before(STAGE_TRANSFORM);
    dq_t i = park_q15(clarke_q15(c->i_q15.a, c->i_q15.b), cossin_q15(angle_q32));
    READY(i.d);
    READY(i.q);

    read_before(STAGE_REGULATE);
    dq_t v = regulate(c, i, w_q15);
    READY(v.d);
    READY(v.q);

    read_before(STAGE_ADVANCE);
    const uint32_t advance_q32 = ((uint32_t)speed_q32 + (uint32_t)(speed_q32 >> 1)) & c->encoder_mask;
    cossin_t cs = cossin_q15(angle_q32 + advance_q32);
    READY(cs.cos);
    READY(cs.sin);

    read_before(STAGE_MODULATE);
    modulate(c, v, i, cs);

    read_before(STAGE_PUBLISH);
    c->i_d_q15 = i.d;
    c->i_q_q15 = i.q;
    c->v_d_q15 = v.d;
    c->v_q_q15 = v.q;
    c->angle_u16 = angle_q32 >> 16;
    c->samples++;

    read_before(STAGE_PROTECT);
    protect(c, w_q15, adc_flags);

    read_before(STAGE_COUNT);
    __asm volatile("nop");
    read_before(STAGE_COUNT + 1u);
}

void stages_run(uint32_t counts[STAGE_COUNT])
{
    const uint32_t mask = cpu_irq_save();
    run();
    cpu_irq_restore(mask);
    const uint32_t overhead = readings[STAGE_COUNT + 1u] - readings[STAGE_COUNT] - 1u;
    for (uint32_t stage = 0; stage < STAGE_COUNT; stage++) {
        counts[stage] = readings[stage + 1u] - readings[stage] - overhead;
    }
}

void stage_write_pwm(uint32_t on_counts)
{
    corepwm_write_legs(on_counts, on_counts, on_counts, CONFIG_DEAD_COUNTS, CONFIG_PWM_COUNTS);
}

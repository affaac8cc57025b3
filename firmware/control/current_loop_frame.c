/* SPDX-License-Identifier: MIT */
/* The frame in which the currents are regulated, the observed rotor's or a prescribed one, and changes between them. */
#include "drivers/cortex/cpu.h"
#include "firmware/control/current_loop.h"
#include "lib/trig.h"

/* Expresses an integral or a reference in the new frame, which is `turn` ahead. */
static void turn_back(volatile int32_t *d, volatile int32_t *q, cossin_t turn)
{
    const int64_t old_d = *d;
    const int64_t old_q = *q;
    *d = (int32_t)((old_d * turn.cos + old_q * turn.sin) >> 15);
    *q = (int32_t)((old_q * turn.cos - old_d * turn.sin) >> 15);
}

/* The feed-forward is part of the integral. */
static void turn_all_back(volatile struct current_loop *c, uint32_t turn_q32)
{
    const cossin_t turn = cossin_q15(turn_q32);
    turn_back(&c->integral_d_q9, &c->integral_q_q9, turn);
    turn_back(&c->i_d_ref_q15, &c->i_q_ref_q15, turn);
    turn_back(&c->feedforward_d_steps, &c->feedforward_q_steps, turn);
}

void current_loop_follow_rotor(volatile struct current_loop *c)
{
    const uint32_t mask = cpu_irq_save();
    turn_all_back(c, c->pll.angle_q32 - current_loop_angle_q32(c));
    c->field_follows = UINT32_MAX;
    c->field_angle_q32 = 0u;
    c->field_speed_q32 = 0;
    cpu_irq_restore(mask);
}

void current_loop_prescribe(volatile struct current_loop *c, uint32_t turn_q32, int32_t speed_q32)
{
    const uint32_t mask = cpu_irq_save();
    turn_all_back(c, turn_q32);
    c->field_angle_q32 = current_loop_angle_q32(c) + turn_q32;
    c->field_follows = 0u;
    c->field_speed_q32 = speed_q32;
    cpu_irq_restore(mask);
}

/* Values not needed before the next sample, but read elsewhere. */
static void turn_seen_back(volatile struct current_loop *c, uint32_t turn_q32)
{
    const cossin_t turn = cossin_q15(turn_q32);
    turn_back(&c->i_d_q15, &c->i_q_q15, turn);
    turn_back(&c->v_d_steps, &c->v_q_steps, turn);
}

void current_loop_hand_over(volatile struct current_loop *c, enum loop_source source, const struct pll *rotor,
                            uint32_t offset_q32)
{
    const uint32_t mask = cpu_irq_save();
    const uint32_t turn_q32 = rotor->angle_q32 + offset_q32 - current_loop_angle_q32(c);
    turn_all_back(c, turn_q32);
    turn_seen_back(c, turn_q32);
    c->pll.angle_q32 = rotor->angle_q32;
    c->pll.speed_q32 = rotor->speed_q32;
    c->angle_offset_q32 = offset_q32;
    c->field_angle_q32 = 0u;
    c->field_speed_q32 = 0;
    c->field_follows = source == LOOP_ENCODER ? 0u : UINT32_MAX;
    current_loop_exchange(c, source);
    cpu_irq_restore(mask);
}

void current_loop_coast(volatile struct current_loop *c, uint32_t turn_q32, int32_t speed_q32)
{
    const uint32_t mask = cpu_irq_save();
    current_loop_prescribe(c, turn_q32, speed_q32);
    turn_seen_back(c, turn_q32);
    c->pll.angle_q32 = c->field_angle_q32;
    c->pll.speed_q32 = speed_q32;
    c->angle_offset_q32 = 0u;
    current_loop_exchange(c, LOOP_OBSERVER);
    cpu_irq_restore(mask);
}

void current_loop_correct(volatile struct current_loop *c, uint32_t by_angle_q32, int32_t by_speed_q32)
{
    const uint32_t mask = cpu_irq_save();
    c->pll.angle_q32 += by_angle_q32;
    c->pll.speed_q32 += by_speed_q32;
    cpu_irq_restore(mask);
}

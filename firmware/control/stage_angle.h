/* SPDX-License-Identifier: MIT */
/*
 * Second stage of the current loop: the field's electrical angle at the sample, and what keeps it up to date. ISR, constant
 * time.
 */
#ifndef FIRMWARE_CONTROL_STAGE_ANGLE_H
#define FIRMWARE_CONTROL_STAGE_ANGLE_H

#include "firmware/control/current_loop.h"
#include "lib/pll.h"

/* The encoder's, as the observer predicted it. */
static inline uint32_t angle_of_rotor(const struct current_loop *c)
{
    return c->pll.angle_q32 + c->angle_offset_q32;
}

/* Prescribed by the slow loop, regardless of the rotor; it turns by itself until the next sample. */
static inline uint32_t angle_of_field(struct current_loop *c)
{
    const uint32_t angle_q32 = c->field_angle_q32;
    c->field_angle_q32 = angle_q32 + (uint32_t)c->field_speed_q32;
    return angle_q32;
}

/* The flux observer's angle, or the prescribed one while it finds the rotor: a mask selects. */
static inline uint32_t angle_observed(struct current_loop *c)
{
    return angle_of_field(c) + (c->pll.angle_q32 & c->field_follows);
}

/* The tracking observer's step, whatever the field's source: the rotor's speed and angle are always known. */
static inline void angle_observe(struct current_loop *c, uint32_t encoder_counts)
{
    pll_track(&c->pll, encoder_counts * c->encoder_scale_q32, CONFIG_PLL_KP_SHIFT, CONFIG_PLL_KI_SHIFT);
}

#endif

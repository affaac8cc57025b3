/* SPDX-License-Identifier: MIT */
/* The slow loop's part of the injection: prepares the interrupt's inputs. */
#include "firmware/control/injection.h"

#include "firmware/control/current_loop.h"
#include "firmware/settings/config.h"
#include "lib/pi.h"
#include "lib/q15.h"
#include "lib/trig.h"

#define RADIAN_Q23 (1 << 23) /* of rad_q8, per response of 1 */

/*
 * From 7.5 LSB a degree the tracking loop has full bandwidth. Below, it decreases with the square, which keeps the angle noise
 * from the sensors constant. The limit is what a load step needs.
 */
#define RADIAN_QUICK 430

/* A clipped wave gives too small a response, so the wave is limited to the available voltage, but at least half. */
#define SHARE_ALL_Q8 256
#define SHARE_MIN_Q8 128

void injection_reset(volatile struct current_loop *c, const struct tuning *t)
{
    c->flux.track = 0;
    c->flux.track_speed_q8 = 0;
    current_loop_run(c, 0);
    c->inject = (struct injection){.turned = t->injection.turned,
                                   .silent = t->injection.silent,
                                   .signs = t->injection.silent != 0 ? INJECTION_SEED : 0u};
    injection_follow(c, t);
}

void injection_resume(volatile struct current_loop *c)
{
    const cossin_t cs = cossin_q15(current_loop_angle_q32(c));
    const int32_t d_q15 = c->i_d_q15;
    const int32_t q_q15 = c->i_q_q15;
    c->inject.i_alpha_q15 = (d_q15 * cs.cos - q_q15 * cs.sin) >> 15;
    c->inject.i_beta_q15 = (d_q15 * cs.sin + q_q15 * cs.cos) >> 15;
    c->inject.step_alpha_q15 = 0;
    c->inject.step_beta_q15 = 0;
    c->inject.first = 0;
}

struct injection_response injection_take(volatile struct current_loop *c)
{
    volatile struct injection *const n = &c->inject;
    const int32_t d = n->sum_d;
    const int32_t q = n->sum_q;
    const struct injection_response seen = {d - n->last_d, q - n->last_q};
    n->last_d = d;
    n->last_q = q;
    return seen;
}

void injection_track(volatile struct current_loop *c, const struct tuning *t, uint32_t angle_q32, int32_t radian)
{
    current_loop_place(c, angle_q32, 0);
    c->inject.full_rad_q8 = q15_min(RADIAN_Q23 / q15_max(radian, 1), INJECTION_RAD_MAX_Q8);
    const int32_t seen = q15_min(radian, RADIAN_QUICK);
    const int32_t quiet = t->injection.track_most * (seen * seen / RADIAN_QUICK) / RADIAN_QUICK;
    c->inject.track = q15_min(quiet, t->injection.track);
}

static int32_t v_steps(int32_t v_q15, int32_t vbus_q15)
{
    return q15_min(v_q15 * (CONFIG_BUS_STEPS / 16) / (vbus_q15 / 16 + 1), INJECTION_V_MAX_STEPS);
}

static int32_t wanted_steps(const volatile struct current_loop *c, const struct tuning *t)
{
    return v_steps(t->injection.v_q15, q15_max(c->vbus_q15, t->v_min_q15));
}

int32_t injection_room_q8(const volatile struct current_loop *c, const struct tuning *t)
{
    const int32_t room_steps = LOOP_V_D_MAX_STEPS - q15_abs(c->integral_d_q9 >> PI_SHIFT);
    return q15_clamp(room_steps, 0, INJECTION_V_MAX_STEPS * 4) * 256 / q15_max(wanted_steps(c, t), 1);
}

/* Increases from 0 to the configured value with the current; the axis turns in the current's direction. */
static int32_t cross_q15(const struct tuning *t, int32_t i_q_q15)
{
    const int32_t i_q15 = q15_clamp(i_q_q15, -t->injection.cross_from_q15, t->injection.cross_from_q15);
    return t->injection.cross_q15 * i_q15 / t->injection.cross_from_q15;
}

void injection_follow(volatile struct current_loop *c, const struct tuning *t)
{
    const int32_t track = c->inject.track;
    const int32_t share_q8 = q15_clamp(injection_room_q8(c, t), SHARE_MIN_Q8, SHARE_ALL_Q8);
    c->inject.share_q8 = share_q8;
    c->inject.v_steps = (wanted_steps(c, t) * share_q8) >> 8;
    c->inject.rad_q8 = q15_min(c->inject.full_rad_q8 * 256 / share_q8, INJECTION_RAD_MAX_Q8);
    c->inject.cross_q15 = cross_q15(t, c->i_q_ref_q15);
    c->flux.track = track;
    c->flux.track_speed_q8 = (int32_t)(((uint32_t)(track * track) * 201u) >> 16);
}

/* SPDX-License-Identifier: MIT */
#include "firmware/commission/pendulum.h"

#include "lib/q15.h"

#define DAMPING_Q4       48 /* of about 0.4 */
#define QUICK_DAMPING_Q4 16
#define QUICK_MS         40
#define LARGEST_Q32      ((int32_t)(UINT32_MAX / 6u))   /* 60 degrees: beyond, the field would turn the rotor away */
#define KICK_Q32         (LARGEST_Q32 / 2)              /* all that one count may move the field */
#define STILL_Q32        ((int32_t)(UINT32_MAX / 180u)) /* 2 degrees, and a count and a half of a coarse encoder */
#define STILL_COUNT_8    12
#define QUICK_PARTS      8 /* of the period: half a swing is four of them */
#define QUICK_SWINGS     6

void pendulum_start(struct pendulum *p, int32_t period_ms, uint32_t encoder_q32, uint32_t field_q32)
{
    p->period_ms = period_ms;
    p->filter_ms = q15_max(period_ms / 16, 1);
    p->damping_q4 = period_ms < QUICK_MS ? QUICK_DAMPING_Q4 : DAMPING_Q4;
    p->half_ms = 0;
    p->quick = 0;
    p->error_q32 = (p->sense < 0 ? 0u - encoder_q32 : encoder_q32) - field_q32;
    p->filtered_q32 = p->error_q32;
    p->quiet_ms = 0;
}

/* Against the rotor's motion. Of a coarse encoder a count would throw the field about: it is damped less. */
static int32_t damped_by_q32(const struct pendulum *p, const volatile struct current_loop *c)
{
    const int32_t behind_q32 = q15_clamp(pendulum_speed_q32(p), -LARGEST_Q32, LARGEST_Q32);
    const int32_t damping_q4 = q15_min(p->damping_q4, KICK_Q32 / (int32_t)(c->encoder_scale_q32 / 16u + 1u));
    return p->sense == 0 ? 0 : q15_clamp(behind_q32 / 16 * damping_q4, -LARGEST_Q32, LARGEST_Q32);
}

/* Halves the damping where it drives what it should damp. Motion that counts as standing still has no sense. */
static void damp_less(struct pendulum *p, int32_t behind_q32, int32_t still_q32)
{
    p->half_ms++;
    if (q15_abs(behind_q32 / 2) <= still_q32 / 2 || (behind_q32 > 0) == p->ahead) {
        return;
    }
    p->ahead = behind_q32 > 0;
    p->quick = p->half_ms < p->period_ms / QUICK_PARTS ? p->quick + 1 : 0;
    p->half_ms = 0;
    if (p->quick == QUICK_SWINGS) {
        p->quick = 0;
        p->damping_q4 /= 2;
    }
}

void pendulum_step(struct pendulum *p, volatile struct current_loop *c, uint32_t encoder_q32, uint32_t field_q32,
                   int32_t step_q32, int32_t current_q15)
{
    const int32_t still_q32 = q15_max(STILL_Q32, (int32_t)(c->encoder_scale_q32 / 8u * STILL_COUNT_8));
    p->error_q32 = (p->sense < 0 ? 0u - encoder_q32 : encoder_q32) - field_q32;
    const int32_t behind_q32 = pendulum_speed_q32(p);
    damp_less(p, behind_q32, still_q32);
    const int32_t damped_q32 = damped_by_q32(p, c);
    p->filtered_q32 += (uint32_t)(behind_q32 / p->filter_ms);
    p->quiet_ms = q15_abs(behind_q32 / 2) <= still_q32 / 2 ? p->quiet_ms + 1u : 0u;
    p->applied_q32 = field_q32 - (uint32_t)damped_q32;
    current_loop_ask(c, current_q15, 0);
    current_loop_field(c, p->applied_q32, step_q32 / c->loops_per_slow);
}

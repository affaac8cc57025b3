/* SPDX-License-Identifier: MIT */
#include "firmware/commission/alignment.h"

#include <stdint.h>

#include "firmware/settings/config.h"
#include "lib/q15.h"

#define RISE_MS      180u
#define TURN_MS      220u
#define SETTLE_MS    200u
#define TURN_Q32     0x40000000u /* a quarter of an electrical turn */
#define TURN_MIN_Q32 (TURN_Q32 / 100u * 60u)
#define TURN_MAX_Q32 (TURN_Q32 / 100u * 160u)

void alignment_start(struct alignment *a, volatile struct current_loop *c)
{
    a->time_ms = 0;
    current_loop_field(c, 0u - TURN_Q32, 0);
}

/*
 * The rotor hangs on the field like a pendulum, and nothing damps it but its friction. A little q current against its speed
 * relative to the field does.
 */
static int32_t damping_q15(const struct tuning *t, int32_t field_rpm_q4, int32_t speed_rpm_q4)
{
    const int64_t against_q16 = (int64_t)(field_rpm_q4 - speed_rpm_q4) * t->align_kd_q16;
    return q15_clamp(q15_sat16((int32_t)(against_q16 >> 16)), -t->i_align_q15, t->i_align_q15);
}

static enum alignment_result finish(const struct alignment *a, volatile struct current_loop *c)
{
    const uint32_t now_q32 = c->pll.angle_q32;
    const uint32_t turned_q32 = now_q32 - a->encoder_before_turn_q32;
    if (turned_q32 < TURN_MIN_Q32 || turned_q32 > TURN_MAX_Q32) {
        return ALIGNMENT_NOT_FOLLOWED;
    }
    c->i_d_ref_q15 = 0;
    c->i_q_ref_q15 = 0;
    current_loop_set_rotor(c, 0);
    return ALIGNMENT_DONE;
}

enum alignment_result alignment_step(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                     int32_t speed_rpm_q4)
{
    /* speed of the turning field: a quarter turn in TURN_MS, as the observer would see it per PWM period */
    const int32_t turn_rpm_q4 = tuning_rpm_q4(t, (int32_t)(TURN_Q32 / (TURN_MS * CONFIG_LOOPS_PER_SLOW)));
    int32_t field_rpm_q4 = 0;
    uint32_t field_q32 = 0u - TURN_Q32;

    a->time_ms++;
    if (a->time_ms <= RISE_MS) {
        c->i_d_ref_q15 = t->i_align_q15 * (int32_t)a->time_ms / (int32_t)RISE_MS;
        a->encoder_before_turn_q32 = c->pll.angle_q32;
    } else if (a->time_ms <= RISE_MS + TURN_MS) {
        field_rpm_q4 = turn_rpm_q4;
        field_q32 += TURN_Q32 / TURN_MS * (a->time_ms - RISE_MS);
    } else if (a->time_ms <= RISE_MS + TURN_MS + SETTLE_MS) {
        field_q32 = 0;
    } else {
        return finish(a, c);
    }
    current_loop_field(c, field_q32, 0);
    c->i_q_ref_q15 = damping_q15(t, field_rpm_q4, speed_rpm_q4);
    return ALIGNMENT_RUNNING;
}

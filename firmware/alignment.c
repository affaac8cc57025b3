/* SPDX-License-Identifier: MIT */
#include "firmware/alignment.h"

#include <stdint.h>

#include "firmware/config.h"
#include "firmware/current_loop.h"
#include "firmware/speed_loop.h"
#include "lib/q15.h"

#define RISE_MS      180u
#define TURN_MS      220u
#define SETTLE_MS    200u
#define TURN_Q32     0x40000000u /* a quarter of an electrical turn */
#define TURN_MIN_Q32 (TURN_Q32 / 100u * 60u)
#define TURN_MAX_Q32 (TURN_Q32 / 100u * 160u)

static uint32_t time_ms;
static uint32_t encoder_before_turn_q32;

void alignment_start(void)
{
    time_ms = 0;
    current_loop_force_angle(0u - TURN_Q32);
}

static uint32_t encoder_angle_q32(void)
{
    return current_loop.pll.angle_q32;
}

/*
 * The rotor hangs on the field like a pendulum, and nothing damps it but its friction. A little q current against its speed
 * relative to the field does.
 */
static int32_t damping_q15(const struct tuning *t, int32_t field_rpm_q4)
{
    const int64_t against_q16 = (int64_t)(field_rpm_q4 - speed_loop.speed_rpm_q4) * t->align_kd_q16;
    return q15_clamp(q15_sat16((int32_t)(against_q16 >> 16)), -t->i_align_q15, t->i_align_q15);
}

static enum alignment_result finish(void)
{
    const uint32_t now_q32 = encoder_angle_q32();
    const uint32_t turned_q32 = now_q32 - encoder_before_turn_q32;
    if (turned_q32 < TURN_MIN_Q32 || turned_q32 > TURN_MAX_Q32) {
        return ALIGNMENT_NOT_FOLLOWED;
    }
    current_loop.i_d_ref_q15 = 0;
    current_loop.i_q_ref_q15 = 0;
    current_loop_force_angle(0); /* the rotor stands there: from now on the offset stays as it is */
    return ALIGNMENT_DONE;
}

enum alignment_result alignment_step(const struct tuning *t)
{
    /* speed of the turning field: a quarter turn in TURN_MS, as the observer would see it per PWM period */
    const int32_t turn_rpm_q4 = tuning_rpm_q4(t, (int32_t)(TURN_Q32 / (TURN_MS * CONFIG_LOOPS_PER_SLOW)));
    int32_t field_rpm_q4 = 0;
    uint32_t field_q32 = 0u - TURN_Q32;

    time_ms++;
    if (time_ms <= RISE_MS) {
        current_loop.i_d_ref_q15 = t->i_align_q15 * (int32_t)time_ms / (int32_t)RISE_MS;
        encoder_before_turn_q32 = encoder_angle_q32();
    } else if (time_ms <= RISE_MS + TURN_MS) {
        field_rpm_q4 = turn_rpm_q4;
        field_q32 += TURN_Q32 / TURN_MS * (time_ms - RISE_MS);
    } else if (time_ms <= RISE_MS + TURN_MS + SETTLE_MS) {
        field_q32 = 0;
    } else {
        return finish();
    }
    current_loop_force_angle(field_q32);
    current_loop.i_q_ref_q15 = damping_q15(t, field_rpm_q4);
    return ALIGNMENT_RUNNING;
}

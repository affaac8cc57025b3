/* SPDX-License-Identifier: MIT */
#include "firmware/control/speed_estimate.h"

#include "firmware/control/speed_estimate_step.h"

#define FAST_RPM_Q15 (15000 * 32768)

/*
 * The counter wrapped, or the shaft moved more than a quarter turn: above a quarter turn a millisecond, more than half a turn
 * is possible in the direction of rotation.
 */
int32_t speed_estimate_unwrapped(int32_t moved, int32_t speed_rpm_q15, int32_t counts)
{
    const int32_t quarters = speed_rpm_q15 > FAST_RPM_Q15 ? 1 : (speed_rpm_q15 < -FAST_RPM_Q15 ? 3 : 2);
    const int32_t least = -(counts >> 2) * quarters;
    const int32_t beyond = moved - least;
    return moved + (beyond < 0 ? counts : (beyond >= counts ? -counts : 0));
}

void speed_estimate_reset(struct speed_estimate *e)
{
    *e = (struct speed_estimate){.interval_clocks = SPEED_ESTIMATE_CLOCKS_LOST, .lost = true};
}

void speed_estimate_go_on(struct speed_estimate *e, const struct encoder_regs *encoder)
{
    const struct estimate_reading r = estimate_read(encoder);
    const uint32_t age = r.latch_clock - r.edge_clock;
    e->moved = 0;
    e->step_clocks = 0;
    e->latch_clock = r.latch_clock;
    e->count = r.count;
    e->backwards = e->speed_rpm_q15 < 0;
    e->clock = r.edge_clock;
    e->lost = age > SPEED_ESTIMATE_CLOCKS_LOST;
    e->beyond_q15 = e->lost ? 0 : estimate_way_q15(e->speed_rpm_q15, age);
    e->interval_clocks = age;
}

void speed_estimate_step(struct speed_estimate *e, const struct encoder_regs *encoder, const struct tuning *t)
{
    estimate_speed(e, encoder, t);
}

void speed_estimate_take(struct speed_estimate *e, int32_t speed_rpm_q15, int32_t travel_q15, uint32_t clocks)
{
    e->speed_rpm_q15 = speed_rpm_q15;
    e->moved = 0;
    e->travel_q15 = travel_q15;
    e->interval_clocks = clocks;
    e->beyond_q15 = 0;
    e->lost = true;
}

/* SPDX-License-Identifier: MIT */
#include "firmware/control/cogging.h"

#include "lib/q15.h"
#include "lib/trig.h"

/* The torque set now acts in the next millisecond: use its middle. 2^32 / 60000 ms / 16, halved. */
#define LEAD_Q32_PER_RPM_Q4 2237

void cogging_set_fade(struct cogging_map *m, int32_t speed_bw_hz)
{
    int32_t highest = 1;
    for (int32_t n = 0; n < m->count; n++) {
        highest = q15_max(highest, (int32_t)m->harmonics[n].order);
    }
    m->full_rpm_q4 = q15_max(60 * 16 * speed_bw_hz / highest, 1);
    m->fade_q15 = 32768 / m->full_rpm_q4;
}

/* 1.0 in Q15 or less; 0 from twice full_rpm_q4 on. */
static int32_t share_q15(const struct cogging_map *m, int32_t speed_rpm_q4)
{
    const int32_t beyond = q15_abs(speed_rpm_q4) - m->full_rpm_q4;
    if (beyond <= 0) {
        return 32768;
    }
    return beyond >= m->full_rpm_q4 ? 0 : 32768 - beyond * m->fade_q15;
}

int32_t cogging_torque_q15(const struct cogging_map *m, const struct speed_estimate *e, const struct tuning *t)
{
    const int32_t speed_rpm_q4 = e->speed_rpm_q15 >> 11;
    const int32_t share = m->count > 0 ? share_q15(m, speed_rpm_q4) : 0;
    if (share == 0) {
        return 0;
    }
    const uint32_t angle_q32 = cogging_angle_q32(e, t) + (uint32_t)(speed_rpm_q4 * LEAD_Q32_PER_RPM_Q4);
    int32_t sum_q23 = 0;
    for (int32_t n = 0; n < m->count; n++) {
        const struct cogging_harmonic *const h = &m->harmonics[n];
        const cossin_t c = cossin_q15(h->order * angle_q32);
        sum_q23 += (int32_t)(((int64_t)h->cos_q23 * c.cos + (int64_t)h->sin_q23 * c.sin) >> 15);
    }
    return (int32_t)(((int64_t)sum_q23 * share) >> 23);
}

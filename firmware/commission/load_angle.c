/* SPDX-License-Identifier: MIT */
#include "firmware/commission/load_angle.h"

#include "lib/angle.h"
#include "lib/q15.h"
#include "lib/trig.h"

#define WIDTH_Q32 ((int32_t)(UINT32_MAX / 6u)) /* 60 degrees: beyond, no load is held at both currents */
#define STEPS     20u                          /* 60 degrees by 2^20 */
#define MORE_PART 4                            /* of the saliency, which is told and saturates */

int32_t load_angle_torque_q15(int32_t current_q15, int32_t saliency_q15, uint32_t angle_q32)
{
    const cossin_t c = cossin_q15(angle_q32);
    const int32_t reluctance_q15 = (((saliency_q15 * current_q15) >> 15) * c.cos) >> 15;
    return (((c.sin * current_q15) >> 15) * (Q15_ONE - reluctance_q15)) >> 15;
}

void load_angle_start(struct load_angle *a)
{
    a->centre_q32 = a->back_q32[0] + (uint32_t)((int32_t)(a->forth_q32[0] - a->back_q32[0]) / 2);
    a->low_q32 = -WIDTH_Q32;
    a->high_q32 = WIDTH_Q32;
    a->steps = 0;
    a->doubted_q32 = 0;
}

/* Sum over both ways of the torque at the larger current, less that at the smaller. It falls as the offset grows. */
static int32_t difference_q15(const struct load_angle *a, int32_t saliency_q15, uint32_t offset_q32)
{
    return load_angle_torque_q15(Q15_ONE, saliency_q15, a->forth_q32[0] - offset_q32) +
           load_angle_torque_q15(Q15_ONE, saliency_q15, a->back_q32[0] - offset_q32) -
           load_angle_torque_q15(a->ratio_q15, saliency_q15, a->forth_q32[1] - offset_q32) -
           load_angle_torque_q15(a->ratio_q15, saliency_q15, a->back_q32[1] - offset_q32);
}

/* First with more saliency than told, then with that: both bisections begin alike. */
bool load_angle_step(struct load_angle *a)
{
    const int32_t more_q15 = a->steps < STEPS ? a->saliency_q15 / MORE_PART : 0;
    const int32_t middle_q32 = a->low_q32 + (a->high_q32 - a->low_q32) / 2;
    if (difference_q15(a, a->saliency_q15 + more_q15, a->centre_q32 + (uint32_t)middle_q32) > 0) {
        a->low_q32 = middle_q32;
    } else {
        a->high_q32 = middle_q32;
    }
    a->steps++;
    if (a->steps == STEPS) {
        a->doubted_q32 = a->low_q32;
        a->low_q32 = -WIDTH_Q32;
        a->high_q32 = WIDTH_Q32;
    }
    return a->steps >= 2u * STEPS;
}

uint32_t load_angle_doubt_q32(const struct load_angle *a)
{
    return angle_size_q32(a->doubted_q32 - a->low_q32);
}

int32_t load_angle_spread_q15(const struct load_angle *a)
{
    const uint32_t offset_q32 = load_angle_offset_q32(a);
    return q15_abs(load_angle_torque_q15(Q15_ONE, a->saliency_q15, a->forth_q32[0] - offset_q32) -
                   load_angle_torque_q15(a->ratio_q15, a->saliency_q15, a->forth_q32[1] - offset_q32));
}

uint32_t load_angle_largest_q32(const struct load_angle *a)
{
    const uint32_t offset_q32 = load_angle_offset_q32(a);
    const uint32_t forth_q32 = angle_size_q32((int32_t)(a->forth_q32[0] - offset_q32));
    const uint32_t back_q32 = angle_size_q32((int32_t)(a->back_q32[0] - offset_q32));
    return forth_q32 > back_q32 ? forth_q32 : back_q32;
}

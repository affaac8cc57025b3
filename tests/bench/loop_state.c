/* SPDX-License-Identifier: MIT */
#include "tests/bench/loop_state.h"

#include "firmware/system/handlers.h"
#include "lib/advance.h"
#include "tests/bench/vectors.h"

#define SPEED_LIMIT (31000 * (1 << 13)) /* of the observer, beyond the largest over-speed threshold */

void loop_state_init(struct current_loop *c)
{
    current_loop_tune(c, &axes[0].tuning);
    c->kp_d_q9 = 3 << 9;
    c->kp_q_q9 = 3 << 9;
    c->ki_q15 = 1 << 12;
}

static void set(struct current_loop *c, int32_t ref_q15, int32_t speed_q32, int32_t integral_q9)
{
    c->i_d_ref_q15 = vector_random(-ref_q15, ref_q15);
    c->i_q_ref_q15 = vector_random(-ref_q15, ref_q15);
    c->angle_offset_q32 = (uint32_t)vector_random(INT32_MIN, INT32_MAX);
    c->pll.speed_q32 = speed_q32;
    c->turn_q15 = vector_random(-ADVANCE_MAX_Q15, ADVANCE_MAX_Q15);
    c->integral_d_q9 = vector_random(-integral_q9, integral_q9);
    c->integral_q_q9 = vector_random(-integral_q9, integral_q9);
}

void loop_state_typical(struct current_loop *c)
{
    set(c, 8192, vector_random(-SPEED_LIMIT, SPEED_LIMIT), 1 << 22);
}

static int32_t pick(uint32_t index, int32_t low, int32_t middle, int32_t high)
{
    return index % 3u == 0u ? low : (index % 3u == 1u ? middle : high);
}

void loop_state_extreme(struct current_loop *c, uint32_t index)
{
    set(c, pick(index, 0, 1, 32767), pick(index / 3u, -SPEED_LIMIT, 0, SPEED_LIMIT),
        pick(index / 9u, 0, 1 << 20, 1 << 24));
}

/* SPDX-License-Identifier: MIT */
#include "tests/bench/loop_state.h"

#include "drivers/fabric/adc.h"
#include "firmware/drive.h"
#include "lib/q15.h"
#include "tests/bench/vectors.h"

#define POLLS       1000000u
#define SPEED_LIMIT (31000 * (1 << 13)) /* of the observer, beyond the largest over-speed threshold */

void loop_state_init(struct current_loop *c)
{
    const struct tuning *const t = &drive.tuning;
    c->pi_d.kp_q12 = t->kp_d_q12;
    c->pi_d.ki_q17 = t->ki_q17;
    c->pi_q.kp_q12 = t->kp_q_q12;
    c->pi_q.ki_q17 = t->ki_q17;
    c->x_d_q11 = t->x_d_q11;
    c->x_q_q11 = t->x_q_q11;
    c->emf_q12 = t->emf_q12;
    c->encoder_scale_q32 = t->encoder_scale_q32;
    c->encoder_mask = UINT32_MAX;
    c->integrate_mask = UINT32_MAX;
    c->armed = TRIP_ALL;
    c->i_trip_q15 = INT32_MAX;
    c->i_sum_q15 = INT32_MAX;
    c->v_min_q15 = 0;
    c->v_max_q15 = INT32_MAX;
    c->overspeed_w_q15 = INT32_MAX;
}

/* Offsets that show sensors at rest as these currents, and one conversion, without its interrupt, that applies them. */
static void show_currents(int32_t current_q15)
{
    uint32_t offset_q15[3];
    for (uint32_t phase = 0; phase < 3u; phase++) {
        const int32_t wanted = (int32_t)BOARD_ADC_OFFSET_NOMINAL - vector_random(-current_q15, current_q15);
        offset_q15[phase] = (uint32_t)q15_clamp(wanted, 0, BOARD_ADC_OFFSET_MAX);
    }
    adc_set_offsets(offset_q15);
    const uint32_t before = adc_sequence();
    ADC->CONTROL = ADC_CONTROL_ENABLE;
    for (uint32_t poll = 0; poll < POLLS && adc_sequence() == before; poll++) {
        /* bounded */
    }
    adc_stop();
}

static void set(struct current_loop *c, int32_t current_q15, int32_t ref_q15, int32_t speed_q32, int32_t integral_q30)
{
    show_currents(current_q15);
    c->i_d_ref_q15 = vector_random(-ref_q15, ref_q15);
    c->i_q_ref_q15 = vector_random(-ref_q15, ref_q15);
    c->angle_offset_q32 = (uint32_t)vector_random(INT32_MIN, INT32_MAX);
    c->pll.speed_q32 = speed_q32;
    c->pi_d.integral_q30 = vector_random(-integral_q30, integral_q30);
    c->pi_q.integral_q30 = vector_random(-integral_q30, integral_q30);
}

void loop_state_typical(struct current_loop *c)
{
    set(c, 8192, 8192, vector_random(-SPEED_LIMIT, SPEED_LIMIT), 1 << 28);
}

static int32_t pick(uint32_t index, int32_t low, int32_t middle, int32_t high)
{
    return index % 3u == 0u ? low : (index % 3u == 1u ? middle : high);
}

void loop_state_extreme(struct current_loop *c, uint32_t index)
{
    set(c, pick(index, 0, 16384, 65535), pick(index / 3u, 0, 1, 32767), pick(index / 9u, -SPEED_LIMIT, 0, SPEED_LIMIT),
        pick(index / 27u, 0, 1 << 20, 1 << 30));
}

/* SPDX-License-Identifier: MIT */
#include "firmware/commission/field_pass.h"

#include "lib/q15.h"

void field_pass_start(struct field_pass *p, int32_t step_q32, uint32_t ramp_ms, uint32_t measure_ms)
{
    p->step_q32 = step_q32;
    p->ramp_ms = ramp_ms;
    p->measure_ms = measure_ms;
    p->time_ms = 0;
    p->sum_q19 = 0;
    p->sum_v_q_q15 = 0;
    for (uint32_t i = 0; i < PASS_THIRDS; i++) {
        p->sum_counts[i] = 0;
    }
}

/* The field's travel in this millisecond: up to speed, along, and down to rest. */
static int32_t field_pass_way_q32(const struct field_pass *p)
{
    const uint32_t down_ms = p->ramp_ms + p->ramp_ms / 2u + p->measure_ms;
    if (p->time_ms < p->ramp_ms) {
        return p->step_q32 / (int32_t)p->ramp_ms * (int32_t)p->time_ms;
    }
    if (p->time_ms < down_ms) {
        return p->step_q32;
    }
    return p->step_q32 / (int32_t)p->ramp_ms * (int32_t)(down_ms + p->ramp_ms - p->time_ms);
}

/* The encoder's sample is one older than the field at the start of this millisecond. */
static void measure(struct field_pass *p, const struct pendulum *rotor, const volatile struct current_loop *c,
                    uint32_t encoder_q32, int32_t counts, uint32_t n)
{
    const uint32_t lead_q32 = rotor->applied_q32 - (uint32_t)(p->step_q32 / c->loops_per_slow) - encoder_q32;
    if (n == 0u) {
        p->reference_q32 = lead_q32;
        p->first_counts = counts;
    }
    p->sum_counts[n / (p->measure_ms / PASS_THIRDS)] += counts - p->first_counts;
    p->sum_q19 += (int32_t)(lead_q32 - p->reference_q32) >> 13;
    p->sum_v_q_q15 += c->v_q_q15;
}

bool field_pass_step(struct field_pass *p, struct pendulum *rotor, volatile struct current_loop *c,
                     uint32_t encoder_q32, int32_t counts, int32_t current_q15)
{
    const uint32_t n = p->time_ms - p->ramp_ms - p->ramp_ms / 2u; /* of the measurement */
    const int32_t way = field_pass_way_q32(p);
    pendulum_step(rotor, c, encoder_q32, p->field_q32, way, current_q15);
    if (n < p->measure_ms) {
        measure(p, rotor, c, encoder_q32, counts, n);
    }
    p->field_q32 += (uint32_t)way;
    p->time_ms++;
    return p->time_ms > 2u * p->ramp_ms + p->ramp_ms / 2u + p->measure_ms;
}

uint32_t field_pass_mean_q32(const struct field_pass *p)
{
    return p->reference_q32 + (uint32_t)(p->sum_q19 / (int32_t)p->measure_ms) * 8192u;
}

int32_t field_pass_counts_q4(const struct field_pass *p)
{
    return (int32_t)((int64_t)(p->sum_counts[2] - p->sum_counts[0]) * (16 * 3 / 2) / (p->measure_ms / PASS_THIRDS));
}

bool field_pass_even(const struct field_pass *p, int32_t part)
{
    const int64_t first = (int64_t)p->sum_counts[1] - p->sum_counts[0];
    const int64_t second = (int64_t)p->sum_counts[2] - p->sum_counts[1];
    const int64_t apart = second > first ? second - first : first - second;
    const int64_t both = second + first < 0 ? -(second + first) : second + first;
    return apart / 2 * part <= both / 2 + (int64_t)part * p->measure_ms;
}

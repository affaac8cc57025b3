/* SPDX-License-Identifier: MIT */
#include "firmware/commission/measure.h"

#include "drivers/fabric/encoder.h"
#include "firmware/settings/config.h"
#include "lib/pi.h"
#include "lib/polar.h"
#include "lib/q15.h"
#include "lib/trig.h"

int32_t measure_steps(const volatile struct current_loop *c, int32_t v_q15)
{
    return v_q15 * (CONFIG_BUS_STEPS / 16) / (c->vbus_q15 / 16 + 1);
}

void measure_hold_voltage(volatile struct current_loop *c, uint32_t angle_q32, int32_t d_steps, int32_t q_steps)
{
    current_loop_field(c, angle_q32, 0);
    current_loop_hold(c, d_steps * (1 << PI_SHIFT), q_steps * (1 << PI_SHIFT));
}

void measure_push(const struct measure_io *io, int32_t i_q_q15)
{
    current_loop_set_currents(io->loop, 0, i_q_q15);
}

bool measure_spin(const struct measure_io *io, int32_t rpm, int32_t i_max_q15)
{
    struct speed_loop *const s = io->speed;
    const struct interval limits = interval_both_ways(i_max_q15);
    s->target_rpm_q16 = rpm * 65536;
    const int32_t demand_q15 = speed_loop_step(s, io->tuning, io->tuning->ramp_q16, &limits);
    measure_push(io, interval_clamp(limits, demand_q15));
    return s->ref_rpm_q16 == rpm * 65536;
}

int32_t measure_emf_q15(const struct measure_io *io)
{
    const volatile struct current_loop *const c = io->loop;
    return c->v_q_q15 - ((c->i_q_q15 * io->tuning->r_q12) >> 12);
}

int32_t measure_counts(uint32_t from, uint32_t to, int32_t turn)
{
    const int32_t moved = (int32_t)to - (int32_t)from;
    return moved > turn / 2 ? moved - turn : moved < -(turn / 2) ? moved + turn : moved;
}

bool measure_index(const struct measure_io *io, uint32_t *at)
{
    const struct encoder_regs *const encoder = &io->fabric->encoder;
    const bool seen = (encoder_status(encoder) & ENCODER_STATUS_INDEX_SEEN) != 0u;
    if (seen) {
        *at = encoder_index(encoder);
    }
    return seen;
}

void measure_run_add(struct measure_run *r, const struct measure_io *io, int32_t v_q15)
{
    const int64_t x_q9 = io->speed->estimate.speed_rpm_q15 >> 6;
    r->i += io->loop->i_q_q15;
    r->v += v_q15;
    r->x += x_q9;
    r->tx += x_q9 * r->count;
    r->xx += x_q9 * x_q9;
    r->xv += x_q9 * (int64_t)v_q15;
    r->count++;
}

void measure_axes_add(struct measure_axes *s, uint32_t angle_q32, int32_t along, int32_t across)
{
    const cossin_t twice = cossin_q15(2u * angle_q32);
    s->re += (int64_t)along * twice.cos - (int64_t)across * twice.sin;
    s->im += (int64_t)along * twice.sin + (int64_t)across * twice.cos;
    s->straight += (int64_t)along * 32768;
}

struct measure_shares measure_axes_shares(const struct measure_axes *s)
{
    int64_t re = s->re, im = s->im, straight = s->straight < 0 ? -s->straight : s->straight;
    while (straight > INT32_MAX / 4) {
        straight /= 2;
        re /= 2;
        im /= 2;
    }
    return (struct measure_shares){(int32_t)re, (int32_t)im, (int32_t)straight};
}

uint32_t measure_axes_angle_q32(const struct measure_axes *s)
{
    const struct measure_shares m = measure_axes_shares(s);
    return atan2_q32(m.im, m.re) / 2u;
}

/* ==== a rotor on a direct current ==== */

#define DAMPING_Q4       48 /* of about 0.4 */
#define QUICK_DAMPING_Q4 16
#define QUICK_MS         40
#define MAX_Q32          ((int32_t)(UINT32_MAX / 6u))   /* 60 degrees: limit of the field's shift */
#define KICK_Q32         (MAX_Q32 / 2)                  /* limit of the shift by one count */
#define STILL_Q32        ((int32_t)(UINT32_MAX / 180u)) /* 2 degrees, and a count and a half of a coarse encoder */
#define STILL_COUNT_8    12
#define QUICK_PARTS      8 /* of the period: half a period is four of them */
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

/* Opposite to the rotor's motion. Less damping with a coarse encoder, where a count would shift the field much. */
static int32_t damped_by_q32(const struct pendulum *p, const volatile struct current_loop *c)
{
    const int32_t behind_q32 = q15_clamp(pendulum_speed_q32(p), -MAX_Q32, MAX_Q32);
    const int32_t damping_q4 = q15_min(p->damping_q4, KICK_Q32 / (int32_t)(c->encoder_scale_q32 / 16u + 1u));
    return p->sense == 0 ? 0 : q15_clamp(behind_q32 / 16 * damping_q4, -MAX_Q32, MAX_Q32);
}

/* Halves the damping if it excites an oscillation. Motion within the standstill threshold has no direction. */
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
    current_loop_set_currents(c, current_q15, 0);
    current_loop_field(c, p->applied_q32, step_q32 / c->loops_per_slow);
}

/* ==== a field that turns ==== */

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

/* The field's travel in this millisecond: acceleration, constant speed, deceleration. */
static int32_t field_pass_travel_q32(const struct field_pass *p)
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
    const int32_t step_q32 = field_pass_travel_q32(p);
    pendulum_step(rotor, c, encoder_q32, p->field_q32, step_q32, current_q15);
    if (n < p->measure_ms) {
        measure(p, rotor, c, encoder_q32, counts, n);
    }
    p->field_q32 += (uint32_t)step_q32;
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

/* SPDX-License-Identifier: MIT */
/* For the steps that turn the rotor: push it, regulate its speed, measure its EMF. Slow loop. */
#include "firmware/commission/identify_parts.h"
#include "lib/q15.h"

#define I_MOST_TENTHS  8
#define LEAST_PART     64    /* of the bus: below, dead time and noise are too much of what is induced */
#define RELUCTANT_PART 16    /* of the rated current */
#define FOLLOW_MS      64    /* the offset's */
#define RADIAN_Q32     20861 /* by Q15: 2^17 / 2 pi */

int32_t identify_i_most_q15(const struct identify *d)
{
    return d->i_rated_q15 * I_MOST_TENTHS / 10;
}

int32_t identify_emf_q15(const struct identify_io *io)
{
    const volatile struct current_loop *const c = io->loop;
    return c->v_q_q15 - ((c->i_q_q15 * io->tuning->r_q12) >> 12);
}

/*
 * A frame ahead of the rotor by x sees (sin x, cos x) times the EMF, in either direction. In addition d has -w Lq i_q: where Lq
 * is large and falls with the current, it is known only at a small current.
 */
void identify_correct_offset(const struct identify *d, const struct identify_io *io)
{
    volatile struct current_loop *const c = io->loop;
    const int32_t w_q15 = current_loop_w_q15(c);
    const int32_t cross_q15 = ((w_q15 * c->i_q_q15) >> 15) * io->tuning->x_q_q11 >> 11;
    const int32_t d_q15 = c->v_d_q15 - ((c->i_d_q15 * io->tuning->r_q12) >> 12) + cross_q15;
    const int32_t q_q15 = q15_abs(identify_emf_q15(io));
    const bool large = q15_abs(c->i_q_q15) * RELUCTANT_PART > d->i_rated_q15;
    if (q15_max(q_q15, q15_abs(d_q15)) * LEAST_PART < c->vbus_q15 || (d->reluctant && large)) {
        return;
    }
    /* beyond 45 degrees a radian is enough to tell the way */
    const int32_t tangent_q15 = q15_abs(d_q15) >= q_q15 ? (d_q15 < 0 ? -Q15_ONE : Q15_ONE) : d_q15 * Q15_ONE / q_q15;
    const int32_t ahead_q15 = w_q15 < 0 ? -tangent_q15 : tangent_q15;
    c->angle_offset_q32 -= (uint32_t)(ahead_q15 * RADIAN_Q32 / FOLLOW_MS);
}

void identify_push(const struct identify_io *io, int32_t i_q_q15)
{
    io->loop->i_d_ref_q15 = 0;
    io->loop->i_q_ref_q15 = i_q_q15;
}

void identify_control_speed(const struct identify_io *io, int32_t target_rpm, int32_t i_most_q15)
{
    struct speed_loop *const s = io->speed;
    const struct interval limits = interval_both_ways(i_most_q15);
    s->target_rpm_q16 = target_rpm * 65536;
    const int32_t wish_q15 = speed_loop_step(s, io->tuning, io->tuning->ramp_q16, &limits);
    identify_push(io, interval_clamp(limits, wish_q15));
}

void identify_run_add(struct identify_run *r, const struct identify_io *io)
{
    identify_run_add_v(r, io, io->loop->v_q_q15);
}

void identify_run_add_v(struct identify_run *r, const struct identify_io *io, int32_t v_q15)
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

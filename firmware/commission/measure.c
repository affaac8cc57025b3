/* SPDX-License-Identifier: MIT */
#include "firmware/commission/measure.h"

#include "drivers/fabric/encoder.h"
#include "firmware/settings/config.h"
#include "lib/pi.h"
#include "lib/polar.h"
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
    current_loop_ask(io->loop, 0, i_q_q15);
}

bool measure_spin(const struct measure_io *io, int32_t rpm, int32_t i_most_q15)
{
    struct speed_loop *const s = io->speed;
    const struct interval limits = interval_both_ways(i_most_q15);
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

uint32_t measure_axes_easy_q32(const struct measure_axes *s)
{
    const struct measure_shares m = measure_axes_shares(s);
    return atan2_q32(m.im, m.re) / 2u;
}

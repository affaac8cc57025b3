/* SPDX-License-Identifier: MIT */
#include "firmware/commission/pull_speed.h"

#include "firmware/settings/config.h"
#include "lib/q15.h"

#define SHARE_BITS  8         /* of the current */
#define FADE        2         /* full current up to this part of the speed */
#define FALLS       2         /* times the speed */
#define STEADY      16        /* part of the current: if it changes by more, inductance takes the voltage */
#define ALONG_MS    2         /* one noisy sample is no braking */
#define LATE        2         /* times align_speed_ms: so late does the encoder tell the speed */
#define GAINS       2         /* a rotor that falls gains this part of the allowed speed */
#define SURE        4         /* one that gains this part of it is not braked */
#define DOUBT       5         /* eighths of R i: with a resistance told twice too large, half of R i is not there */
#define LARGEST_Q32 (1 << 29) /* an eighth of a turn in a millisecond: nothing is so fast here */

static int32_t emf_q15(const struct tuning *t)
{
    return ((t->align_speed_q32 / (int32_t)CONFIG_PERIODS_PER_SLOW >> CONFIG_W_SHIFT) * t->emf_q12) >> 12;
}

/* Inductance takes voltage while the current changes. */
static void feel_field(struct pull_speed *s, const volatile struct current_loop *c, const struct tuning *t)
{
    const bool steady = q15_abs(c->i_d_q15 - s->i_d_q15) < t->align[0].i_q15 / STEADY;
    s->drop_q15 = (s->i_d_q15 * t->r_q12) >> 12;
    s->e_d_q15 = q15_sat16(c->v_d_q15 - s->drop_q15); /* whatever the resistance is told to be */
    s->along_q15 = steady ? s->along_q15 + (s->e_d_q15 - s->along_q15) / ALONG_MS : 0;
    s->i_d_q15 = c->i_d_q15;
}

/* While the current flows, a resistance told wrongly hides what is induced: from then on the encoder has to show it. */
static void see_braking(struct pull_speed *s, const struct tuning *t)
{
    const int32_t size_q32 = q15_abs(s->speed_q32);
    const bool fast = size_q32 > t->align_speed_q32 / FADE;
    if (fast && !s->brakes && s->along_q15 < -(emf_q15(t) / FADE + q15_abs(s->drop_q15) * DOUBT / 8)) {
        s->brakes = true;
        s->slowest_q32 = size_q32;
    }
    s->slowest_q32 = q15_min(s->slowest_q32, size_q32);
    if (s->brakes && (!fast || size_q32 - s->slowest_q32 >= t->align_speed_q32 / SURE)) {
        s->brakes = false;
        s->along_q15 = 0;
    }
}

/* The encoder tells the speed late: what it was at the end of the pull shows only then. */
static void see_free_run(struct pull_speed *s, const struct tuning *t)
{
    const int32_t size_q32 = q15_abs(s->speed_q32);
    s->free_ms = s->brakes || size_q32 < t->align_speed_q32 ? 0 : s->free_ms + 1;
    s->let_go_q32 = s->free_ms <= LATE * t->align_speed_ms ? size_q32 : q15_min(s->let_go_q32, size_q32);
}

void pull_speed_step(struct pull_speed *s, const volatile struct current_loop *c, const struct tuning *t,
                     int32_t moved_q32)
{
    s->speed_q32 += (q15_clamp(moved_q32, -LARGEST_Q32, LARGEST_Q32) - s->speed_q32) / t->align_speed_ms;
    feel_field(s, c, t);
    see_braking(s, t);
    see_free_run(s, t);
}

int32_t pull_speed_current_q15(const struct pull_speed *s, const struct tuning *t, int32_t current_q15)
{
    const int32_t left_q32 = q15_max(t->align_speed_q32 - q15_abs(s->speed_q32), 0);
    const int32_t share = left_q32 / (t->align_speed_q32 / FADE >> SHARE_BITS);
    return s->brakes ? current_q15 : (current_q15 * q15_min(share, 1 << SHARE_BITS)) >> SHARE_BITS;
}

void pull_speed_field_moves(struct pull_speed *s)
{
    s->brakes = false;
}

bool pull_speed_falls(const struct pull_speed *s, const struct tuning *t)
{
    const int32_t size_q32 = q15_abs(s->speed_q32);
    return size_q32 / FALLS > t->align_speed_q32 && size_q32 - s->let_go_q32 > t->align_speed_q32 / GAINS;
}

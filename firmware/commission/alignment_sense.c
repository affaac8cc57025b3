/* SPDX-License-Identifier: MIT */
/* Finds the encoder's counting direction while the rotor is pulled. */
#include "firmware/commission/alignment.h"
#include "firmware/commission/alignment_parts.h"
#include "lib/q15.h"
#include "lib/trig.h"

/* ==== the encoder's direction ==== */

void encoder_sense_start(struct encoder_sense *s)
{
    *s = (struct encoder_sense){0};
}

void encoder_sense_step(struct encoder_sense *s, int32_t e_d_q15, int32_t e_q_q15, uint32_t field_q32,
                        uint32_t angle_q32, int32_t moved)
{
    const cossin_t f = cossin_q15(field_q32);
    const cossin_t x = cossin_q15(angle_q32);
    const int64_t d = (int64_t)((e_d_q15 * f.cos - e_q_q15 * f.sin) >> 15) * moved;
    const int64_t q = (int64_t)((e_q_q15 * f.cos + e_d_q15 * f.sin) >> 15) * moved;
    s->cd += d * x.cos;
    s->sd += d * x.sin;
    s->cq += q * x.cos;
    s->sq += q * x.sin;
}

/* Shifted right by this much, all four fit in 15 bits and a sign. */
static uint32_t places(const struct encoder_sense *s)
{
    const int64_t bits =
        (s->cd ^ (s->cd >> 63)) | (s->sd ^ (s->sd >> 63)) | (s->cq ^ (s->cq >> 63)) | (s->sq ^ (s->sq >> 63));
    uint32_t n = 0;
    while (bits >> n > Q15_ONE) {
        n++;
    }
    return n;
}

int32_t encoder_sense_q15(const struct encoder_sense *s)
{
    const uint32_t n = places(s);
    const int32_t cd = (int32_t)(s->cd >> n), sd = (int32_t)(s->sd >> n);
    const int32_t cq = (int32_t)(s->cq >> n), sq = (int32_t)(s->sq >> n);
    const int32_t size_q30 = (cd * cd >> 2) + (sd * sd >> 2) + (cq * cq >> 2) + (sq * sq >> 2);
    const int32_t difference_q30 = (cd * sq >> 1) - (cq * sd >> 1);
    return size_q30 == 0 ? 0 : difference_q30 / (size_q30 / (1 << 15) + 1);
}

#define SENSE_STEP  4096
#define FAST_PART   2 /* of the speed that is allowed: so much tells a swing from counts here and there */
#define SLOW_PART   4 /* of the fastest */
#define TURN_PARTS  24
#define SWING_PARTS 2 /* of a turn: further than a rotor bounces between its teeth */
#define FAR_PARTS   10
#define LIKELY_Q15  12000 /* of alignment.h: a quarter of a turn */
#define SURE_Q15    28000 /* half a turn, or some swings */

void alignment_begin_swing(struct alignment *a)
{
    a->sense_sum = 0;
    a->v_q_sum_q15 = 0;
    a->swing_ms = 0;
    a->swing_from = a->counts;
    a->furthest = 0;
    a->fastest_q32 = 0;
}

/* An electrical turn has 24 parts, as the parameters say it. */
static int32_t turn_parts(const struct tuning *t, int32_t parts)
{
    return t->encoder_counts * parts / (TURN_PARTS * t->pole_pairs);
}

static void follow_swing(struct alignment *a, const volatile struct current_loop *c, int32_t moved, uint32_t angle_q32,
                         uint32_t field_q32)
{
    encoder_sense_step(&a->turned_with, a->speed.e_d_q15, c->v_q_q15, field_q32, angle_q32, moved);
    a->sense_sum += c->v_q_q15 * moved;
    a->v_q_sum_q15 += c->v_q_q15;
    a->swing_ms++;
    a->fastest_q32 = q15_max(a->fastest_q32, q15_abs(a->speed.speed_q32));
    a->furthest = q15_max(a->furthest, q15_abs(a->counts - a->swing_from));
}

/* It has swung, and is about to turn back. */
static bool slows(const struct alignment *a, const struct tuning *t)
{
    return a->furthest > turn_parts(t, SWING_PARTS) && a->fastest_q32 > t->align_speed_q32 / FAST_PART &&
           q15_abs(a->speed.speed_q32) < a->fastest_q32 / SLOW_PART;
}

/* The rotor has swung and is half way back. */
static bool comes_back(const struct alignment *a, const struct tuning *t)
{
    return a->furthest > turn_parts(t, SWING_PARTS) && q15_abs(a->counts - a->swing_from) < a->furthest / 2;
}

/*
 * Near the field the q voltage has the sense of the motion: what it has in common with the motion, without what is constant in
 * it. Of a reluctant machine the constant part counts, too: its rotor hardly swings.
 */
static int64_t voltage_with_motion(const struct alignment *a, const struct tuning *t)
{
    const int64_t constant = (int64_t)a->v_q_sum_q15 * (a->counts - a->swing_from);
    return t->reluctant ? a->sense_sum : a->sense_sum * (int64_t)a->swing_ms - constant;
}

/* Since this attempt began. */
static bool has_moved(const struct alignment *a, const struct tuning *t, int32_t parts)
{
    return q15_abs(a->counts - a->origin) > turn_parts(t, parts);
}

/*
 * Which way the encoder counts (alignment.h). Until that is known nothing is damped, for damping in the wrong sense would
 * drive the rotor. Voltages are small here; they show it when the rotor has swung forward and half way back, for what dead time
 * adds has cancelled by then. One that swings by less than a quarter of a turn is near the field (voltage_with_motion). One
 * that does not swing at all follows the first pass, which leaves no doubt; nor does half a turn, if the rotor is about to turn
 * back: at full speed the field must not move, it would take the rotor on.
 *
 * Where reluctance holds the rotor the voltage's sense changes beyond 45 degrees from the hold, and all of the way counts.
 */
void alignment_feel_sense(struct alignment *a, const volatile struct current_loop *c, const struct tuning *t,
                          int32_t moved, uint32_t angle_q32)
{
    if (a->rotor.sense != 0 || a->stage >= STAGE_DROP) {
        return;
    }
    const uint32_t field_q32 = a->stage == STAGE_PASS ? a->passing.field_q32 : a->field_q32;
    follow_swing(a, c, q15_clamp(moved, -SENSE_STEP, SENSE_STEP), angle_q32, field_q32);
    const int32_t shown_q15 = t->reluctant ? 0 : encoder_sense_q15(&a->turned_with);
    const bool swung = t->reluctant ? slows(a, t) || has_moved(a, t, FAR_PARTS) : comes_back(a, t);
    const bool sure = q15_abs(shown_q15) > SURE_Q15 && (a->stage == STAGE_PASS || slows(a, t));
    if (sure || (swung && q15_abs(shown_q15) > LIKELY_Q15)) {
        a->rotor.sense = shown_q15 < 0 ? -1 : 1;
    } else if (swung) {
        a->rotor.sense = voltage_with_motion(a, t) < 0 ? -1 : 1;
    }
    if (a->rotor.sense != 0) {
        pendulum_start(&a->rotor, a->rotor.period_ms, angle_q32, field_q32);
    }
}

/* SPDX-License-Identifier: MIT */
#include "firmware/control/oscillation.h"

#include "firmware/control/notch.h"
#include "firmware/settings/config.h"
#include "lib/polar.h"
#include "lib/q15.h"

/* ==== a tone ==== */

#define SQUARES_BITS 15
#define C_MOST_Q13   16384 /* 2.0 */
#define REST_MAX     (1 << 16)

/* All three sums in proportion, the squares below 2^SQUARES_BITS. They are not negative. */
static uint32_t shift_to_bits(int64_t squares)
{
    const uint32_t high = (uint32_t)(squares >> 32);
    const int32_t bits = 64 - (high != 0u ? __builtin_clz(high) : 32 + __builtin_clz((uint32_t)squares | 1u));
    return bits > SQUARES_BITS ? (uint32_t)(bits - SQUARES_BITS) : 0u;
}

struct tone_found tone_find(const struct tone *t)
{
    const uint32_t shift = shift_to_bits(t->squares);
    const int32_t squares = (int32_t)(t->squares >> shift);
    if (squares == 0) {
        return (struct tone_found){C_MOST_Q13, REST_MAX};
    }
    const int32_t products = (int32_t)(t->products >> shift); /* below 2^17, but for the ends of a block that grows */
    const int32_t c_q13 = q15_clamp((int32_t)((int64_t)products * 8192 / squares), -C_MOST_Q13, C_MOST_Q13);
    const int64_t rest_q13 =
        (t->sums >> shift) * 8192 - (int64_t)c_q13 * (2 * products) + (((int64_t)c_q13 * c_q13 * squares) >> 13);
    const int64_t share_q13 = rest_q13 / squares;
    return (struct tone_found){c_q13, share_q13 > REST_MAX ? REST_MAX : (int32_t)share_q13};
}

int32_t tone_hz(int32_t c_q13, int32_t sample_hz)
{
    const int32_t sine_q13 = polar_root_down((uint32_t)(C_MOST_Q13 * C_MOST_Q13 - c_q13 * c_q13));
    return (int32_t)(((uint64_t)atan2_q32(sine_q13, c_q13) * (uint32_t)sample_hz + 0x80000000u) >> 32);
}

#define FIRST_PART     4 /* of i_max, */
#define LATER_PART     8 /* and once it has swung: what is left may be just at the border */
#define BLOCK_STEPS    16u
#define BEFORE_PART    64u /* of the power: in a block before */
#define SETTLE_BLOCKS  1u  /* after a change of the gains, for what swings at the limit */
#define FADE_BLOCKS    4u  /* and for what may fade: a loop near its border fades slowly */
#define LISTEN_MS      25u
#define DEAF_MS        5u    /* of these: until the torque is what it will stay */
#define FAST_C_Q13     14354 /* OSCILLATION_HZ */
#define IMPURE_Q13     9830  /* 1.2: a tone among harmonics; noise has 2 */
#define HARD_BLOCKS    4u
#define RINGS_Q13      2458                                  /* 0.3 */
#define STRAIGHT_C_Q13 16220                                 /* 25 Hz: it only drifts */
#define RING_PART      (64u << 2 * OSCILLATION_LISTEN_SHIFT) /* of the power before */
#define BORDER_HALVED  20861                                 /* 4 / pi / 2, Q15 */
#define HALF_Q15       16384
#define WITH_NOTCH_Q15 22938 /* 0.7: what the coupling left is not known yet */

void oscillation_reset(struct oscillation *o)
{
    o->tone = (struct tone){.squares = 0};
    o->steps = 0;
    o->demand_sum_q15 = 0;
    o->seen_sum_q12 = 0;
    o->level_q24[0] = 0;
    o->level_q24[1] = 0;
    o->hard_blocks = 0;
    o->listens = false;
}

void oscillation_init(struct oscillation *o)
{
    *o = (struct oscillation){.blocks = FADE_BLOCKS};
}

bool oscillation_is_answered(const struct oscillation *o)
{
    return o->listens || (o->answered != 0u && o->blocks < FADE_BLOCKS);
}

static uint32_t square_q24(int32_t x)
{
    return (uint32_t)(x * x);
}

/* Twice the mean square is the amplitude's. */
static int32_t half_of_border_q15(uint32_t level_q24, int32_t i_max_q12)
{
    const int32_t amplitude_q12 = q15_max(polar_root_down(level_q24 * 2u), 1);
    return q15_min(HALF_Q15, i_max_q12 * BORDER_HALVED / amplitude_q12);
}

static void take_share(struct oscillation *o, int32_t share_q15)
{
    oscillation_reset(o);
    o->share_q15 = share_q15;
    o->answered++;
    o->blocks = 0;
}

static bool was_there(uint32_t before_q24, uint32_t level_q24)
{
    return before_q24 > level_q24 / BEFORE_PART;
}

static bool lasts(uint32_t before_q24, uint32_t level_q24)
{
    return level_q24 > before_q24 - before_q24 / 4u;
}

/* No answer to a step, which from the few samples that a block has of it may pass for a tone. */
static bool has_two_sides(const struct oscillation *o)
{
    return (int64_t)o->seen_sum_q12 * o->seen_sum_q12 < o->tone.squares;
}

/*
 * What swings far beyond the limit did so in the block before, too; a step's answer did not. Less may be fading since the last
 * change: it is compared with the block before the last. The first swing is taken as it begins, since at the limit it may fall
 * below OSCILLATION_HZ; a later one may be a light rotor's answer to the end of a ramp: it has to have been there for two
 * blocks.
 */
static bool goes_on(const struct oscillation *o, uint32_t level_q24, int32_t i_max_q12)
{
    const bool was_last = was_there(o->level_q24[0], level_q24);
    if (level_q24 * 2u > square_q24(i_max_q12)) {
        return o->blocks >= SETTLE_BLOCKS && was_last && lasts(o->level_q24[0], level_q24);
    }
    const bool begins = !was_last || !was_there(o->level_q24[1], level_q24);
    return o->blocks >= FADE_BLOCKS && ((o->answered == 0u && has_two_sides(o)) || !begins) &&
           lasts(o->level_q24[1], level_q24);
}

static bool is_fast_swing(const struct oscillation *o, const struct tone_found *found)
{
    return found->c_q13 < FAST_C_Q13 && (found->rest_q13 < IMPURE_Q13 || o->hard_blocks >= HARD_BLOCKS);
}

/* An amplitude of 0.7 i_max. */
static void count_hard(struct oscillation *o, uint32_t level_q24, int32_t i_max_q12)
{
    const bool hard = level_q24 * 4u > square_q24(i_max_q12) && o->edge_q12 * 2 < i_max_q12;
    o->hard_blocks = hard ? o->hard_blocks + 1u : 0u;
}

static enum oscillation_verdict answer(struct oscillation *o, uint32_t level_q24, int32_t i_max_q12)
{
    if (o->only_counts || o->answered == OSCILLATION_ANSWERS_MOST) {
        return OSCILLATION_NOTHING;
    }
    if (!o->listened) {
        o->tone = (struct tone){.before = {o->tone.before[0], o->tone.before[1]}};
        o->listens = true;
        return OSCILLATION_LET_GO;
    }
    take_share(o, half_of_border_q15(level_q24, i_max_q12));
    return OSCILLATION_LESS;
}

/* Above what edges make of a slow shaft's speed; but what meets the limit is a swing, whatever the encoder. */
static int32_t least_q12(const struct oscillation *o, int32_t i_max_q12)
{
    const int32_t part_q12 = i_max_q12 / (o->answered == 0u ? FIRST_PART : LATER_PART);
    return q15_min(q15_max(part_q12, o->edge_q12), i_max_q12);
}

static enum oscillation_verdict judge_block(struct oscillation *o, int32_t i_max_q12)
{
    const uint32_t level_q24 = (uint32_t)(o->tone.squares / BLOCK_STEPS);
    const bool loud = level_q24 * 2u > square_q24(least_q12(o, i_max_q12)) && goes_on(o, level_q24, i_max_q12);
    count_hard(o, level_q24, i_max_q12);
    const struct tone_found found = loud ? tone_find(&o->tone) : (struct tone_found){FAST_C_Q13, IMPURE_Q13};
    o->mean_q15 = o->demand_sum_q15 / (int32_t)BLOCK_STEPS;
    o->demand_sum_q15 = 0;
    o->seen_sum_q12 = 0;
    o->steps = 0;
    o->blocks += o->blocks < FADE_BLOCKS ? 1u : 0u;
    o->level_q24[1] = o->level_q24[0];
    o->level_q24[0] = level_q24;
    tone_next(&o->tone);
    if (!is_fast_swing(o, &found)) {
        return OSCILLATION_NOTHING;
    }
    o->found++;
    o->hz = tone_hz(found.c_q13, CONFIG_SLOW_HZ);
    return answer(o, level_q24, i_max_q12);
}

/* Only the motion counts, not the drift of a shaft that nobody holds: differences. */
static enum oscillation_verdict judge_ring(struct oscillation *o, int32_t i_max_q12)
{
    const struct tone_found found = tone_find(&o->tone);
    const uint32_t level_q24 = o->level_q24[0];
    const bool heard = found.rest_q13 < RINGS_Q13 && found.c_q13 < NOTCH_C_MOST_Q13 &&
                       (uint64_t)o->tone.squares / (LISTEN_MS - DEAF_MS) > level_q24 / RING_PART;
    o->listened = true;
    if (heard) {
        o->ring_c_q13 = found.c_q13;
        take_share(o, WITH_NOTCH_Q15);
        return OSCILLATION_NOTCH;
    }
    o->light = found.c_q13 > STRAIGHT_C_Q13 && (found.rest_q13 < RINGS_Q13 || o->tone.squares == 0);
    take_share(o, half_of_border_q15(level_q24, i_max_q12));
    return OSCILLATION_LESS;
}

static enum oscillation_verdict listen_to_shaft(struct oscillation *o, int32_t seen_q12, int32_t i_max_q12)
{
    const int32_t moved_q12 = q15_clamp(seen_q12 - o->seen_q12, -INT16_MAX, INT16_MAX);
    o->seen_q12 = seen_q12;
    o->steps++;
    if (o->steps <= DEAF_MS) {
        o->tone = (struct tone){.before = {moved_q12, o->tone.before[0]}};
        return OSCILLATION_NOTHING;
    }
    tone_add(&o->tone, moved_q12);
    return o->steps < LISTEN_MS ? OSCILLATION_NOTHING : judge_ring(o, i_max_q12);
}

enum oscillation_verdict oscillation_step(struct oscillation *o, int32_t seen_q12, int32_t demand_q15,
                                          int32_t i_max_q15)
{
    const int32_t i_max_q12 = i_max_q15 >> 3;
    if (o->listens) {
        return listen_to_shaft(o, seen_q12, i_max_q12);
    }
    tone_add(&o->tone, seen_q12);
    o->seen_sum_q12 += o->tone.before[1]; /* of the samples whose squares there are */
    o->demand_sum_q15 += demand_q15;
    o->steps++;
    return o->steps < BLOCK_STEPS ? OSCILLATION_NOTHING : judge_block(o, i_max_q12);
}

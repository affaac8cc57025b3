/* SPDX-License-Identifier: MIT */
/*
 * A step of the speed estimate (speed_estimate.h), inlined into its caller: saving and passing registers would take a quarter
 * of its time.
 */
#ifndef FIRMWARE_CONTROL_SPEED_ESTIMATE_STEP_H
#define FIRMWARE_CONTROL_SPEED_ESTIMATE_STEP_H

#include "firmware/control/speed_estimate.h"
#include "lib/q15.h"
#include "lib/usually.h"

#define ESTIMATE_MS_CLOCKS 100000u /* of 10 ns */
#define ESTIMATE_MS_Q29    5369u   /* a clock in milliseconds */
#define ESTIMATE_CLOCKS_SHORT \
    32768u /* below a third of a millisecond: the shaft was jerked, and its speed is meaningless */
#define ESTIMATE_PLACE_OFF_Q16 32768 /* half a count too early or too late: the speed has changed, nothing is learned */
#define ESTIMATE_PLACE_SHIFT   6     /* 1/64 of it is applied */
#define ESTIMATE_EDGES_LEARNED 32    /* in a step; beyond, their places are already learned */
#define ESTIMATE_MAX_Q15       (1 << 30) /* 32768 rpm, or its travel in a millisecond */
#define ESTIMATE_BOUND_Q8      288       /* an eighth over a count: edges are slightly out of place */

struct estimate_reading {
    uint32_t count, edge_clock, latch_clock;
};

/* All three from one trigger: if another came meanwhile, they are read again, and a third cannot come that soon. */
static inline struct estimate_reading estimate_read(const struct encoder_regs *encoder)
{
    struct estimate_reading r;
    uint32_t before;
    do {
        before = encoder_latch_clock(encoder);
        r = (struct estimate_reading){encoder_latched(encoder), encoder_edge_clock(encoder),
                                      encoder_latch_clock(encoder)};
    } while (r.latch_clock != before);
    return r;
}

static inline int32_t estimate_counts_moved(const struct speed_estimate *e, uint32_t count, int32_t counts)
{
    const int32_t moved = (int32_t)(count - e->count);
    return USUALLY(q15_abs(moved) <= counts >> 2) ? moved : speed_estimate_unwrapped(moved, e->speed_rpm_q15, counts);
}

/* A product in one instruction: knowing the sign, the compiler would use two. */
static inline int64_t estimate_product(int32_t x, uint32_t y)
{
    __asm__("" : "+r"(y));
    return (int64_t)x * (int32_t)y;
}

/* x / 2^shift, at most +-ESTIMATE_MAX_Q15: the upper word tells. */
static inline int32_t estimate_limited(int64_t x, uint32_t shift)
{
    const int32_t high = (int32_t)(x >> 32);
    const int32_t most = ESTIMATE_MAX_Q15 >> (32u - shift);
    return high >= most ? ESTIMATE_MAX_Q15 : (high < -most ? -ESTIMATE_MAX_Q15 : (int32_t)(x >> shift));
}

static inline int32_t estimate_way_of(int32_t way_q8, const struct tuning *t)
{
    return (int32_t)(((int64_t)way_q8 * t->way_per_count_q12) >> 12);
}

/*
 * Travel over clocks, as a speed. The reciprocal has 15 bits at a millisecond and fewer as edges get rarer and the speed lower;
 * travel is counted, not integrated.
 */
static inline int32_t estimate_speed_of(int32_t turned_q15, uint32_t clocks)
{
    const uint32_t per_ms_q15 =
        (ESTIMATE_MS_CLOCKS << 15) / (clocks < ESTIMATE_CLOCKS_SHORT ? ESTIMATE_CLOCKS_SHORT : clocks);
    return estimate_limited(estimate_product(turned_q15, per_ms_q15), 15);
}

/* Travel at a speed in a time; up to 2.6 ms without a second long product. */
static inline int32_t estimate_way_q15(int32_t speed_rpm_q15, uint32_t clocks)
{
    if (USUALLY(clocks < 1u << 18)) {
        return (int32_t)(estimate_product(speed_rpm_q15, clocks * ESTIMATE_MS_Q29) >> 29);
    }
    return estimate_limited(estimate_product(speed_rpm_q15, (uint32_t)(((uint64_t)clocks * ESTIMATE_MS_Q29) >> 13)),
                            16);
}

/*
 * At the previous speed the shaft would have turned this much farther: the two edges are off by that. What one gains the other
 * loses.
 */
static inline void estimate_learn(struct speed_estimate *e, uint32_t from, uint32_t to, int32_t farther_q15,
                                  const struct tuning *t)
{
    const int32_t off_q16 = (int32_t)(((int64_t)farther_q15 * t->count_per_way_q16) >> 16);
    if (q15_abs(off_q16) < ESTIMATE_PLACE_OFF_Q16) {
        e->place_q16[to & 3u] += off_q16 >> ESTIMATE_PLACE_SHIFT;
        e->place_q16[from & 3u] -= off_q16 >> ESTIMATE_PLACE_SHIFT;
    }
}

/* An edge came. Returns the travel since the one before. */
static inline int32_t estimate_take_edge(struct speed_estimate *e, const struct estimate_reading *r,
                                         const struct tuning *t)
{
    const int32_t moved = estimate_counts_moved(e, r->count, t->encoder_counts);
    const int32_t backwards = USUALLY(moved != 0) ? (moved < 0) : e->backwards;
    const uint32_t from = e->count + (uint32_t)e->backwards;
    const uint32_t to = r->count + (uint32_t)backwards;
    const int32_t edges = moved + backwards - e->backwards;
    const int32_t way_q8 = edges * 256 + (e->place_q16[to & 3u] >> 8) - (e->place_q16[from & 3u] >> 8);
    const int32_t turned_q15 = estimate_way_of(way_q8, t);
    const uint32_t clocks = r->edge_clock - e->clock;
    if (USUALLY(!e->lost)) {
        const int32_t before_rpm_q15 = e->speed_rpm_q15;
        e->speed_rpm_q15 = estimate_speed_of(turned_q15, clocks);
        e->interval_clocks = clocks;
        if (q15_abs(edges) <= ESTIMATE_EDGES_LEARNED) {
            estimate_learn(e, from, to, estimate_way_q15(before_rpm_q15 - e->speed_rpm_q15, clocks), t);
        }
    } else {
        e->lost = false;
    }
    e->moved = moved;
    e->count = r->count;
    e->backwards = backwards;
    e->clock = r->edge_clock;
    return turned_q15;
}

/* No edge came for this long. */
static inline void estimate_wait(struct speed_estimate *e, uint32_t clocks, const struct tuning *t)
{
    const int32_t bound_rpm_q15 = estimate_speed_of(estimate_way_of(ESTIMATE_BOUND_Q8, t), clocks);
    e->speed_rpm_q15 = q15_clamp(e->speed_rpm_q15, -bound_rpm_q15, bound_rpm_q15);
    e->interval_clocks = clocks > e->interval_clocks ? clocks : e->interval_clocks;
}

static inline __attribute__((always_inline)) void
estimate_speed(struct speed_estimate *e, const struct encoder_regs *encoder, const struct tuning *t)
{
    const struct estimate_reading r = estimate_read(encoder);
    const uint32_t age = r.latch_clock - r.edge_clock;
    int32_t turned_q15 = 0; /* between two edges */
    e->step_clocks = r.latch_clock - e->latch_clock;
    e->latch_clock = r.latch_clock;
    if (USUALLY(r.edge_clock != e->clock) || r.count != e->count) {
        turned_q15 = estimate_take_edge(e, &r, t);
    } else {
        e->moved = 0;
        if (!e->lost) {
            estimate_wait(e, age, t);
        }
    }
    if (SELDOM(age > SPEED_ESTIMATE_CLOCKS_LOST || e->lost)) {
        e->lost = true;
        e->speed_rpm_q15 = 0;
        e->travel_q15 = turned_q15; /* and the travel beyond the edge stays */
    } else {
        const int32_t beyond_q15 = estimate_way_q15(e->speed_rpm_q15, age);
        e->travel_q15 = turned_q15 - e->beyond_q15 + beyond_q15;
        e->beyond_q15 = beyond_q15;
    }
}

#endif

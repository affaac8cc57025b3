/* SPDX-License-Identifier: MIT */
#include "firmware/control/speed_estimate.h"

#include "firmware/settings/scale.h"
#include "lib/q15.h"

#define MS_CLOCKS       100000u /* of 10 ns */
#define MS_Q29          5369u   /* a clock in milliseconds */
#define CLOCKS_SHORT    32768u  /* below a third of a millisecond: the shaft was jerked, and its speed is meaningless */
#define OFFSET_MOST_Q16 32768   /* half a count too early or too late: the speed has changed, nothing is learned */
#define OFFSET_SHIFT    6       /* 1/64 of it is applied */
#define EDGES_LEARNED   256     /* in a step; beyond, half a count is too little of the speed to matter */
#define MAX_Q15         ((1 << 30) - 1) /* 32768 rpm, or its travel in a millisecond: twice that fits */
#define BOUND_Q8        288             /* an eighth over a count: edges are slightly out of place */
#define FAST_RPM_Q15    (15000 * 32768)

struct reading {
    uint32_t count, edge_clock, latch_clock;
};

/* All three from one trigger: if another came meanwhile, they are read again, and a third cannot come that soon. */
static struct reading read_encoder(const struct encoder_regs *encoder)
{
    struct reading r;
    uint32_t before;
    do {
        before = encoder_latch_clock(encoder);
        r = (struct reading){encoder_latched(encoder), encoder_edge_clock(encoder), encoder_latch_clock(encoder)};
    } while (r.latch_clock != before);
    return r;
}

/*
 * The counter wrapped, or the shaft moved more than a quarter turn: above a quarter turn a millisecond, more than half a turn
 * is possible in the direction of rotation.
 */
static int32_t unwrapped(int32_t moved, int32_t speed_rpm_q15, int32_t counts)
{
    const int32_t quarters = speed_rpm_q15 > FAST_RPM_Q15 ? 1 : (speed_rpm_q15 < -FAST_RPM_Q15 ? 3 : 2);
    const int32_t least = -(counts >> 2) * quarters;
    const int32_t beyond = moved - least;
    return moved + (beyond < 0 ? counts : (beyond >= counts ? -counts : 0));
}

static int32_t counts_moved(const struct speed_estimate *e, uint32_t count, int32_t counts)
{
    const int32_t moved = (int32_t)(count - e->count);
    return q15_abs(moved) <= counts >> 2 ? moved : unwrapped(moved, e->speed_rpm_q15, counts);
}

/* x / 2^shift, at most +-MAX_Q15: the upper word shows which. */
static int32_t limited_shift(int64_t x, uint32_t shift)
{
    const int32_t high = (int32_t)(x >> 32);
    const int32_t most = (1 << 30) >> (32u - shift);
    return high >= most ? MAX_Q15 : (high < -most ? -MAX_Q15 : (int32_t)(x >> shift));
}

static int32_t travel_of(int32_t travel_q8, const struct tuning *t)
{
    return (int32_t)(((int64_t)travel_q8 * t->travel_per_count_q12) >> 12);
}

/*
 * Travel over clocks, as a speed. The reciprocal has 15 bits at a millisecond and fewer as edges get rarer and the speed lower;
 * travel is counted, not integrated.
 */
static int32_t speed_between_edges(int32_t turned_q15, uint32_t clocks)
{
    const int32_t per_ms_q15 = (int32_t)((MS_CLOCKS << 15) / (clocks < CLOCKS_SHORT ? CLOCKS_SHORT : clocks));
    return limited_shift((int64_t)turned_q15 * per_ms_q15, 15);
}

/* Travel at a speed in a time; up to 2.6 ms without a second long product. */
static int32_t travel_in_q15(int32_t speed_rpm_q15, uint32_t clocks)
{
    if (clocks < 1u << 18) {
        return (int32_t)(((int64_t)speed_rpm_q15 * (int32_t)(clocks * MS_Q29)) >> 29);
    }
    return limited_shift((int64_t)speed_rpm_q15 * (int32_t)(((uint64_t)clocks * MS_Q29) >> 13), 16);
}

/*
 * At the previous speed the shaft would have turned this much more: the two edges are off by that. What one gains the other
 * loses.
 */
static void learn_edges(struct speed_estimate *e, uint32_t from, uint32_t to, int32_t extra_travel_q15,
                        const struct tuning *t)
{
    const int32_t off_q16 = (int32_t)(((int64_t)extra_travel_q15 * t->counts_per_travel_q16) >> 16);
    if (q15_abs(off_q16) < OFFSET_MOST_Q16) {
        e->edge_offset_q16[to & 3u] += off_q16 >> OFFSET_SHIFT;
        e->edge_offset_q16[from & 3u] -= off_q16 >> OFFSET_SHIFT;
    }
}

/* An edge came. Returns the travel since the one before. */
static int32_t take_edge(struct speed_estimate *e, const struct reading *r, const struct tuning *t)
{
    const int32_t moved = counts_moved(e, r->count, t->encoder_counts);
    const int32_t backwards = moved != 0 ? (moved < 0) : e->backwards;
    const uint32_t from = e->count + (uint32_t)e->backwards;
    const uint32_t to = r->count + (uint32_t)backwards;
    const int32_t edges = moved + backwards - e->backwards;
    const int32_t travel_q8 = edges * 256 + (e->edge_offset_q16[to & 3u] >> 8) - (e->edge_offset_q16[from & 3u] >> 8);
    const int32_t turned_q15 = travel_of(travel_q8, t);
    const uint32_t clocks = r->edge_clock - e->clock;
    if (!e->lost) {
        const int32_t before_rpm_q15 = e->speed_rpm_q15;
        e->speed_rpm_q15 = speed_between_edges(turned_q15, clocks);
        e->interval_clocks = clocks;
        if (q15_abs(edges) <= EDGES_LEARNED) {
            learn_edges(e, from, to, travel_in_q15(before_rpm_q15 - e->speed_rpm_q15, clocks), t);
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
static void bound_speed(struct speed_estimate *e, uint32_t clocks, const struct tuning *t)
{
    const int32_t bound_rpm_q15 = speed_between_edges(travel_of(BOUND_Q8, t), clocks);
    e->speed_rpm_q15 = q15_clamp(e->speed_rpm_q15, -bound_rpm_q15, bound_rpm_q15);
    e->interval_clocks = clocks > e->interval_clocks ? clocks : e->interval_clocks;
}

void speed_estimate_reset(struct speed_estimate *e)
{
    *e = (struct speed_estimate){.interval_clocks = SPEED_ESTIMATE_CLOCKS_LOST, .lost = true};
}

void speed_estimate_resume(struct speed_estimate *e, const struct encoder_regs *encoder)
{
    const struct reading r = read_encoder(encoder);
    const uint32_t age = r.latch_clock - r.edge_clock;
    e->moved = 0;
    e->step_clocks = 0;
    e->latch_clock = r.latch_clock;
    e->count = r.count;
    e->backwards = e->speed_rpm_q15 < 0;
    e->clock = r.edge_clock;
    e->lost = age > SPEED_ESTIMATE_CLOCKS_LOST;
    e->beyond_q15 = e->lost ? 0 : travel_in_q15(e->speed_rpm_q15, age);
    e->interval_clocks = age;
}

void speed_estimate_step(struct speed_estimate *e, const struct encoder_regs *encoder, const struct tuning *t)
{
    const struct reading r = read_encoder(encoder);
    const uint32_t age = r.latch_clock - r.edge_clock;
    int32_t turned_q15 = 0; /* between two edges */
    e->step_clocks = r.latch_clock - e->latch_clock;
    e->latch_clock = r.latch_clock;
    if (r.edge_clock != e->clock || r.count != e->count) {
        turned_q15 = take_edge(e, &r, t);
    } else {
        e->moved = 0;
        if (!e->lost) {
            bound_speed(e, age, t);
        }
    }
    if (age > SPEED_ESTIMATE_CLOCKS_LOST || e->lost) {
        e->lost = true;
        e->speed_rpm_q15 = 0;
        e->travel_q15 = q15_clamp(turned_q15, -MAX_Q15, MAX_Q15); /* and the travel beyond the edge stays */
    } else {
        const int32_t beyond_q15 = travel_in_q15(e->speed_rpm_q15, age);
        e->travel_q15 = scale_clamp((int64_t)turned_q15 - e->beyond_q15 + beyond_q15, -MAX_Q15, MAX_Q15);
        e->beyond_q15 = beyond_q15;
    }
}

void speed_estimate_take(struct speed_estimate *e, int32_t speed_rpm_q15, int32_t travel_q15, uint32_t clocks)
{
    e->speed_rpm_q15 = q15_clamp(speed_rpm_q15, -MAX_Q15, MAX_Q15);
    e->moved = 0;
    e->travel_q15 = q15_clamp(travel_q15, -MAX_Q15, MAX_Q15);
    e->interval_clocks = clocks;
    e->beyond_q15 = 0;
    e->lost = true;
}

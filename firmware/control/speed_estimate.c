/* SPDX-License-Identifier: MIT */
#include "firmware/control/speed_estimate.h"

#include "lib/q15.h"

#define CLOCKS_LOST   (1u << 28) /* 2.7 s without an edge: at rest, long before the clock wraps */
#define MS_Q32        42950u     /* a clock of 10 ns in milliseconds */
#define SHORTEST      8192u      /* clocks; edges of two readings are farther apart unless the shaft jumps */
#define PLACE_MAX_Q16 16384      /* a quarter of a count either way */
#define PLACE_SHIFT   5
#define FAST_RPM_Q15  (15000 * 32768)
#define MAX_Q15       (1 << 30) /* 32768 rpm, or as much way in a millisecond */
#define BOUND_Q8      288       /* an eighth over a count: edges stand a little apart from their places */

struct reading {
    uint32_t count, edge_clock, latch_clock;
};

/* All three of one trigger: if another came meanwhile, they are read again, and a third cannot be so near. */
static struct reading read_encoder(const struct encoder_regs *encoder)
{
    struct reading r = {encoder_latched(encoder), encoder_edge_clock(encoder), encoder_latch_clock(encoder)};
    if (encoder_latched(encoder) != r.count || encoder_latch_clock(encoder) != r.latch_clock) {
        r = (struct reading){encoder_latched(encoder), encoder_edge_clock(encoder), encoder_latch_clock(encoder)};
    }
    return r;
}

/*
 * Counts turned. Above a quarter of a turn a millisecond more than half a turn may be meant, in the direction it turns.
 */
static int32_t counts_moved(const struct speed_estimate *e, uint32_t count, int32_t counts)
{
    const int32_t ahead = e->speed_rpm_q15 > FAST_RPM_Q15 ? 1 : (e->speed_rpm_q15 < -FAST_RPM_Q15 ? 3 : 2);
    const int32_t least = -(counts >> 2) * ahead;
    int32_t moved = (int32_t)(count - e->count) - least;
    moved += moved < 0 ? counts : 0;
    moved -= moved >= counts ? counts : 0;
    return moved + least;
}

/* way_q8 counts in so many clocks, as a speed: 15 bits and more of it are right. */
static int32_t speed_of(int32_t way_q8, uint32_t clocks, const struct tuning *t)
{
    const uint32_t way = (uint32_t)q15_abs(way_q8) | 1u;
    const uint32_t time = clocks < SHORTEST ? SHORTEST : clocks;
    const uint32_t way_shift = (uint32_t)__builtin_clz(way);
    const int32_t more = 15 - __builtin_clz(time);
    const uint32_t time_shift = more > 0 ? (uint32_t)more : 0u;
    const uint32_t ratio = (way << way_shift) / (time >> time_shift);
    const uint64_t speed = ((uint64_t)ratio * t->speed_per_count) >> (way_shift + time_shift - 4u);
    const int32_t bounded = speed > MAX_Q15 ? MAX_Q15 : (int32_t)speed;
    return way_q8 < 0 ? -bounded : bounded;
}

/* The way of a speed in a time. */
static int32_t way_q15(int32_t speed_rpm_q15, uint32_t clocks)
{
    const int32_t ms_q16 = (int32_t)(((uint64_t)clocks * MS_Q32) >> 16);
    const int64_t way = ((int64_t)speed_rpm_q15 * ms_q16) >> 16;
    return way > MAX_Q15 ? MAX_Q15 : (way < -MAX_Q15 ? -MAX_Q15 : (int32_t)way);
}

/* The shaft has turned by `missed` more than from the one place to the other: they are farther apart. */
static void learn(struct speed_estimate *e, uint32_t from, uint32_t to, int32_t missed_q15, const struct tuning *t)
{
    const int64_t missed_q16 = ((int64_t)missed_q15 * t->count_per_way_q16) >> 16;
    if (missed_q16 > PLACE_MAX_Q16 || missed_q16 < -PLACE_MAX_Q16) {
        return; /* the speed changes */
    }
    const int32_t step_q16 = (int32_t)missed_q16 >> PLACE_SHIFT;
    e->place_q16[to & 3u] = q15_clamp(e->place_q16[to & 3u] + step_q16, -PLACE_MAX_Q16, PLACE_MAX_Q16);
    e->place_q16[from & 3u] = q15_clamp(e->place_q16[from & 3u] - step_q16, -PLACE_MAX_Q16, PLACE_MAX_Q16);
}

/* An edge has come. Returns the way from the one before. */
static int32_t take_edge(struct speed_estimate *e, const struct reading *r, const struct tuning *t)
{
    const int32_t moved = counts_moved(e, r->count, t->encoder_counts);
    const int32_t backwards = moved != 0 ? (moved < 0) : e->backwards;
    const uint32_t from = e->count + (uint32_t)e->backwards;
    const uint32_t to = r->count + (uint32_t)backwards;
    const int32_t edges = moved + backwards - e->backwards;
    const int32_t way_q8 = edges * 256 + ((e->place_q16[to & 3u] - e->place_q16[from & 3u]) >> 8);
    const int32_t turned_q15 = (int32_t)(((int64_t)way_q8 * t->way_per_count_q12) >> 12);
    const uint32_t clocks = r->edge_clock - e->clock;
    if (e->lost) {
        e->speed_rpm_q15 = 0;
    } else {
        learn(e, from, to, way_q15(e->speed_rpm_q15, clocks) - turned_q15, t);
        e->speed_rpm_q15 = edges != 0 ? speed_of(way_q8, clocks, t) : 0;
        e->interval_clocks = clocks;
    }
    e->count = r->count;
    e->backwards = backwards;
    e->clock = r->edge_clock;
    e->lost = false;
    return turned_q15;
}

/* None has come, for so long. */
static void wait_for_edge(struct speed_estimate *e, uint32_t clocks, const struct tuning *t)
{
    const int32_t bound_rpm_q15 = speed_of(BOUND_Q8, clocks, t);
    e->speed_rpm_q15 = q15_clamp(e->speed_rpm_q15, -bound_rpm_q15, bound_rpm_q15);
    e->interval_clocks = clocks > e->interval_clocks ? clocks : e->interval_clocks;
}

void speed_estimate_reset(struct speed_estimate *e)
{
    *e = (struct speed_estimate){.interval_clocks = CLOCKS_LOST, .lost = true};
}

void speed_estimate_step(struct speed_estimate *e, const struct encoder_regs *encoder, const struct tuning *t)
{
    const struct reading r = read_encoder(encoder);
    const uint32_t age = r.latch_clock - r.edge_clock;
    int32_t turned_q15 = -e->beyond_q15;
    if (r.edge_clock != e->clock || r.count != e->count) {
        turned_q15 += take_edge(e, &r, t);
    } else if (!e->lost) {
        wait_for_edge(e, age, t);
    }
    if (age > CLOCKS_LOST || e->lost) {
        e->lost = true;
        e->speed_rpm_q15 = 0;
        turned_q15 += e->beyond_q15; /* and there it stays */
    } else {
        e->beyond_q15 = way_q15(e->speed_rpm_q15, age);
        turned_q15 += e->beyond_q15;
    }
    e->travel_q15 = turned_q15;
}

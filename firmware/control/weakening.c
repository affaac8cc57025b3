/* SPDX-License-Identifier: MIT */
#include "firmware/control/weakening.h"

#include "lib/q15.h"

#define PART_SHIFT 12
#define LAST       (WEAKENING_NODES - 1)

/* The last row not above the flux: a binary search over rows 0...24, which steps of 16 and 8 cover. */
static int32_t row_below(const struct weakening *w, int32_t flux_q15)
{
    int32_t n = 0;
    for (int32_t step = WEAKENING_BELOW; step > 0; step /= 2) {
        n += n + step < WEAKENING_ROWS && w->flux_q15[n + step] <= flux_q15 ? step : 0;
    }
    return n;
}

struct weakening_row weakening_row(const struct weakening *w, int32_t flux_q15)
{
    const int32_t n = row_below(w, flux_q15);
    const struct weakening_node *const lower = w->node[n];
    const int32_t above_q15 = flux_q15 - w->flux_q15[n];
    if (n == WEAKENING_ROWS - 1 || above_q15 <= 0) {
        return (struct weakening_row){lower, lower, 0};
    }
    const uint32_t gap_q15 = (uint32_t)(w->flux_q15[n + 1] - w->flux_q15[n]);
    const uint32_t part_q10 = ((uint32_t)above_q15 << 10) / gap_q15;
    return (struct weakening_row){lower, w->node[n + 1], (int32_t)(part_q10 << (PART_SHIFT - 10))};
}

struct weakening_node weakening_least_current(const struct torque_map *m, int32_t torque_q15)
{
    return (struct weakening_node){.torque_q15 = (int16_t)torque_q15,
                                   .i_d_q15 = (int16_t)torque_map_at(m, m->i_d_q15, torque_q15),
                                   .i_q_q15 = (int16_t)torque_map_at(m, m->i_q_q15, torque_q15)};
}

static int32_t between(int32_t lower, int32_t upper, int32_t part_q12)
{
    return lower + (((upper - lower) * part_q12) >> PART_SHIFT);
}

static int32_t torque_at(const struct weakening_row *r, int32_t n)
{
    return between(r->lower[n].torque_q15, r->upper[n].torque_q15, r->part_q12);
}

static struct weakening_node node_between(const struct weakening_node *a, const struct weakening_node *b,
                                          int32_t part_q12)
{
    return (struct weakening_node){.torque_q15 = (int16_t)between(a->torque_q15, b->torque_q15, part_q12),
                                   .i_d_q15 = (int16_t)between(a->i_d_q15, b->i_d_q15, part_q12),
                                   .i_q_q15 = (int16_t)between(a->i_q_q15, b->i_q_q15, part_q12)};
}

static struct weakening_node node_at(const struct weakening_row *r, int32_t n)
{
    return node_between(&r->lower[n], &r->upper[n], r->part_q12);
}

static uint32_t square(const struct weakening_node *p)
{
    return (uint32_t)(p->i_d_q15 * p->i_d_q15) + (uint32_t)(p->i_q_q15 * p->i_q_q15);
}

/* The squared current is convex along a chord: a share of squares never gives too large a share of the chord. */
static int32_t torque_within(const struct weakening_node *a, const struct weakening_node *b, uint32_t most)
{
    const uint32_t from = square(a);
    const uint32_t to = square(b);
    const uint32_t gap = ((to - from) >> PART_SHIFT) + 1u;
    return between(a->torque_q15, b->torque_q15, q15_min((int32_t)((most - from) / gap), 1 << PART_SHIFT));
}

int32_t weakening_torque(const struct weakening_row *r, int32_t i_limit_q15)
{
    const uint32_t most = (uint32_t)i_limit_q15 * (uint32_t)i_limit_q15;
    const struct weakening_node last = node_at(r, LAST);
    if (square(&last) <= most) {
        return last.torque_q15;
    }
    struct weakening_node below = node_at(r, 0);
    if (square(&below) >= most) {
        return 0;
    }
    struct weakening_node above = last;
    int32_t n = 0;
    for (int32_t step = LAST / 2; step > 0; step /= 2) {
        const struct weakening_node middle = node_at(r, n + step);
        if (square(&middle) <= most) {
            n += step;
            below = middle;
        } else {
            above = middle;
        }
    }
    return torque_within(&below, &above, most);
}

struct weakening_node weakening_currents(const struct weakening_row *r, int32_t torque_q15)
{
    int32_t n = 0;
    for (int32_t step = LAST / 2; step > 0; step /= 2) {
        n += torque_at(r, n + step) <= torque_q15 ? step : 0;
    }
    const struct weakening_node a = node_at(r, n);
    const struct weakening_node b = node_at(r, n + 1);
    const int32_t gap = q15_max(b.torque_q15 - a.torque_q15, 1);
    const int32_t part_q12 = (q15_clamp(torque_q15 - a.torque_q15, 0, gap) << PART_SHIFT) / gap;
    return node_between(&a, &b, part_q12);
}

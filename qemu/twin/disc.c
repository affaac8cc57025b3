/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "disc.h"

#include "extremes.h"

#define TURN_RAD   6.283185307179586
#define CELL       0x1p-24 /* in which an edge is located, of a way of 50 us: 3 ps */
#define NEAR_EDGES 1e-6    /* so close to an edge the count is always computed: rounding must not decide */

static void miscount_init(struct miscount *m, double per_turn, double edges_per_turn, uint64_t seed,
                          enum random_stream stream)
{
    random_seed_stream(&m->random, seed, stream);
    m->mean_gap = per_turn > 0 ? edges_per_turn / per_turn : 0;
    m->next = m->mean_gap * random_exponential(&m->random);
}

void disc_init(struct disc *d, const struct sensor_params *p, uint64_t seed)
{
    double turn = p->index_angle_rad / TURN_RAD, a = 4 * p->encoder_asymmetry, phase = 4 * p->encoder_phase;
    *d = (struct disc){
        .edges_per_turn = p->encoder_counts,
        .shift = {-a, phase - a, a, phase + a},
        .ecc_rad = p->encoder_ecc_rad,
        .ecc_phase_rad = p->encoder_ecc_phase_rad,
        .from_rad = 1,
        .to_rad = 0,
    };
    d->index.turn = (int64_t)p->encoder_counts;
    d->index.first = (int64_t)floor((turn - floor(turn)) * p->encoder_counts);
    d->index.last = d->index.first + (int64_t)p->encoder_index_counts - 1;
    miscount_init(&d->lost, p->encoder_lost_per_rev, p->encoder_counts, seed, STREAM_LOST_COUNTS);
    miscount_init(&d->extra, p->encoder_extra_per_rev, p->encoder_counts, seed, STREAM_EXTRA_COUNTS);
}

/* In edges from angle 0. */
static double edge_at(const struct disc *d, int64_t n)
{
    return (double)n + d->shift[n & 3];
}

/* The shown angle moves at most 1 + ecc times as far as the shaft does. */
static void keep_window(struct disc *d, double theta_rad, double before, double after)
{
    double shaft_rad = TURN_RAD / d->edges_per_turn / (1 + d->ecc_rad);
    d->from_rad = theta_rad - (before - NEAR_EDGES) * shaft_rad;
    d->to_rad = theta_rad + (after - NEAR_EDGES) * shaft_rad;
}

static double shown_edges(const struct disc *d, double theta_rad)
{
    double shown_rad = theta_rad;
    if (d->ecc_rad != 0) {
        shown_rad += d->ecc_rad * sin(theta_rad - d->ecc_phase_rad);
    }
    return shown_rad / TURN_RAD * d->edges_per_turn;
}

int64_t disc_edges(struct disc *d, double theta_rad)
{
    if (theta_rad >= d->from_rad && theta_rad < d->to_rad) {
        return d->edges;
    }
    double at = shown_edges(d, theta_rad);
    int64_t n = (int64_t)floor(at);
    /* An edge is displaced by less than the distance of two, so it can only be one off. */
    if (at < edge_at(d, n)) {
        n--;
    } else if (at >= edge_at(d, n + 1)) {
        n++;
    }
    d->edges = n;
    keep_window(d, theta_rad, at - edge_at(d, n), edge_at(d, n + 1) - at);
    return n;
}

/* Hermite's cubic: angles and speeds of both ends. */
static double angle_on(const struct disc_way *w, double part)
{
    double left = 1 - part;
    return w->from_rad * left * left * (1 + 2 * part) + w->to_rad * part * part * (1 + 2 * left) +
           w->length_s * part * left * (w->from_rad_s * left - w->to_rad_s * part);
}

/* Two places of a way, and how far each is beyond the edge. */
struct bracket {
    double before, after, before_edges, after_edges;
};

static void narrow(struct bracket *b, double part, double beyond_edges)
{
    *(beyond_edges >= 0 ? &b->after : &b->before) = part;
    *(beyond_edges >= 0 ? &b->after_edges : &b->before_edges) = beyond_edges;
}

/* The way is all but straight: a chord finds the cell, whose two ends are then looked at; should it bend, a half follows. */
double disc_edge_part(const struct disc *d, const struct disc_way *w, int64_t moved)
{
    double edge = edge_at(d, moved > 0 ? d->edges : d->edges + 1), sign = moved > 0 ? 1 : -1;
#define BEYOND(part) (sign * (shown_edges(d, angle_on(w, part)) - edge))
    struct bracket b = {0, 1, BEYOND(0.0), BEYOND(1.0)};
    while (b.after - b.before > CELL) {
        double chord = b.before + (b.after - b.before) * b.before_edges / (b.before_edges - b.after_edges);
        double cell = larger(lesser(floor(chord / CELL) * CELL, b.after - CELL), b.before);
        double middle = b.before + floor((b.after - b.before) / CELL / 2) * CELL;
        const double looks[] = {cell + CELL, cell, middle};
        for (int n = 0; n < 3; n++) {
            if (looks[n] > b.before && looks[n] < b.after) {
                narrow(&b, looks[n], BEYOND(looks[n]));
            }
        }
    }
    return b.after;
#undef BEYOND
}

static int64_t miscounts(struct miscount *m, int64_t passed)
{
    int64_t count = 0;
    if (m->mean_gap == 0) {
        return 0;
    }
    for (m->next -= (double)passed; m->next <= 0; count++) {
        m->next += m->mean_gap * random_exponential(&m->random);
    }
    return count;
}

int64_t disc_miscounts(struct disc *d, int64_t moved)
{
    int64_t passed = moved < 0 ? -moved : moved;
    int64_t more = miscounts(&d->extra, passed) - miscounts(&d->lost, passed);
    return moved < 0 ? -more : more;
}

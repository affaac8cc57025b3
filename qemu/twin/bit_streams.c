/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "bit_streams.h"

#include <string.h>

void bit_streams_init(struct bit_streams *s, double noise, uint64_t seed)
{
    memset(s, 0, sizeof *s);
    s->noise = noise;
    random_seed_stream(&s->random, seed, STREAM_MODULATORS);
}

static struct stretch *nth(struct bit_streams *s, unsigned n)
{
    return &s->list[(s->first + n) % STRETCHES_ROOM];
}

static void drop_oldest(struct bit_streams *s)
{
    s->first = (s->first + 1) % STRETCHES_ROOM;
    s->count--;
}

void bit_streams_follow(struct bit_streams *s, const struct stretch *newest)
{
    if (s->count == STRETCHES_ROOM) {
        s->lost_ps = nth(s, 0)->to_ps;
        drop_oldest(s);
    }
    *nth(s, s->count++) = *newest;
}

bool bit_streams_forgot(const struct bit_streams *s, double at_ps)
{
    return at_ps < s->lost_ps;
}

/* Where in its stretch a time lies; beyond the last one, by what the bus takes, is its end. */
static double part_of(const struct stretch *now, double at_ps)
{
    double part = (at_ps - now->from_ps) / (now->to_ps - now->from_ps);
    return part < 0 ? 0 : (part > 1 ? 1 : part);
}

unsigned bit_streams_clock(struct bit_streams *s, double at_ps)
{
    static const struct stretch rest = {.to_ps = 1};
    while (s->count > 1 && nth(s, 0)->to_ps < at_ps) {
        drop_oldest(s);
    }
    const struct stretch *now = s->count ? nth(s, 0) : &rest;
    double part = part_of(now, at_ps);
    unsigned bits = 0;
    for (int k = 0; k < 3; k++) {
        double input = now->from[k] + part * (now->to[k] - now->from[k]) + s->noise * random_bell(&s->random);
        bits |= modulator_clock(&s->modulator[k], input) ? 1u << k : 0u;
    }
    return bits;
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "lines.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static int64_t later(int64_t a, int64_t b)
{
    return a > b ? a : b;
}

/* The first clock edge at which a change at that time is seen. */
static int64_t clock_of(double t_ps)
{
    return (int64_t)ceil(t_ps / SIM_PS_PER_FABRIC_CLOCK);
}

/* Lists the lines as they are from `clock` on, or behind what is listed already. */
static void list(struct lines *l, int64_t clock)
{
    if (l->count == LINES_ROOM) {
        fputs("mssfoc twin: more edges of the encoder than the fabric's clock can follow\n", stderr);
        exit(1);
    }
    l->now.clock = l->count ? later(clock, l->now.clock) : clock;
    l->list[(l->first + l->count++) % LINES_ROOM] = l->now;
}

static void step_phase(struct lines *l, int64_t edges)
{
    int64_t phase = ((int64_t)l->phase + (l->reversed ? -edges : edges)) % 4;
    l->phase = (unsigned)(phase < 0 ? phase + 4 : phase);
    l->now.a = l->phase == 1 || l->phase == 2;
    l->now.b = l->phase == 2 || l->phase == 3;
}

static bool indexed(const struct index_pulse *pulse, int64_t edges)
{
    int64_t place = (edges - pulse->first) % pulse->turn;
    return (place < 0 ? place + pulse->turn : place) <= pulse->last - pulse->first;
}

/* Edges that the receiver lost or doubled on a way are lost or doubled with its last. */
static void miscount(struct lines *l, int64_t edges, int64_t clock)
{
    int64_t sign = edges < 0 ? -1 : 1;
    for (int64_t n = 0; n != edges; n += sign) {
        step_phase(l, sign);
        list(l, clock + 1 + n * sign);
    }
}

/* Only the time of the last edge is known. The others are spread evenly before it; the physics seldom goes far enough for
 * two. */
void lines_turn(struct lines *l, const struct shaft_way *way, const struct index_pulse *pulse, int64_t now)
{
    int64_t count = way->moved < 0 ? -way->moved : way->moved, sign = way->moved < 0 ? -1 : 1;
    bool last_is_lost = way->miscounted * sign < 0;
    double each_ps = (way->last_edge_ps - (double)way->from) / (double)count;
    for (int64_t n = 1; n <= count && !l->frozen; n++) {
        step_phase(l, n == count && last_is_lost ? 0 : sign);
        l->now.index = indexed(pulse, way->edges - (count - n) * sign);
        list(l, later(now, clock_of((double)way->from + (double)n * each_ps)));
    }
    if (!l->frozen) {
        miscount(l, way->miscounted + (last_is_lost ? sign : 0), l->now.clock);
    }
}

void lines_show_hall(struct lines *l, unsigned state, double changed_ps, int64_t now)
{
    l->now.hall = (uint8_t)state;
    list(l, later(now, clock_of(changed_ps)));
}

/* Single edges, far enough from each other for the filter. */
static void slip(struct lines *l, int64_t edges, int64_t now)
{
    int64_t sign = edges < 0 ? -1 : 1;
    for (int64_t n = 0; n != edges; n += sign) {
        step_phase(l, l->reversed ? -sign : sign);
        list(l, now + (n * sign) * (l->filter + 2));
    }
}

void lines_disturb(struct lines *l, enum cable_fault fault, int64_t value, int64_t now)
{
    switch (fault) {
    case CABLE_CUT:
        l->now.lost = value != 0;
        list(l, now);
        break;
    case CABLE_FROZEN:
        l->frozen = value != 0;
        break;
    case CABLE_REVERSED:
        l->reversed = value != 0;
        break;
    case CABLE_ILLEGAL:
        step_phase(l, 2); /* a disturbance of both lines at once, which passes */
        list(l, now);
        step_phase(l, 2);
        list(l, now + l->filter + 2);
        break;
    default:
        slip(l, value, now);
        break;
    }
}

int64_t lines_next(const struct lines *l)
{
    return l->count ? l->list[l->first].clock : INT64_MAX;
}

struct line_state lines_take(struct lines *l)
{
    struct line_state taken = l->list[l->first];
    l->first = (l->first + 1) % LINES_ROOM;
    l->count--;
    return taken;
}

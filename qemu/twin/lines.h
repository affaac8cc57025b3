/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The lines of encoder and Hall switches as a list of what they become when, for an RTL that is clocked afterwards. */
#ifndef TWIN_LINES_H
#define TWIN_LINES_H

#include <stdbool.h>
#include <stdint.h>

#include "fabric.h"

#define LINES_ROOM 4096 /* a power of two */

struct line_state {
    int64_t clock;
    bool a, b, index, lost;
    uint8_t hall;
};

struct lines {
    struct line_state now; /* the newest that is listed */
    struct line_state list[LINES_ROOM];
    unsigned first, count;
    unsigned phase; /* of A and B: 0 to 3, A first */
    bool frozen, reversed;
    unsigned filter; /* clocks that the counter wants a level to stay */
};

/* The shaft went this way; nothing is listed before clock `now`. */
void lines_turn(struct lines *l, const struct shaft_way *way, const struct index_pulse *pulse, int64_t now);
void lines_show_hall(struct lines *l, unsigned state, double changed_ps, int64_t now);
void lines_disturb(struct lines *l, enum cable_fault fault, int64_t value, int64_t now);
/* The clock of the next change, INT64_MAX if none is listed; and the lines behind it. */
int64_t lines_next(const struct lines *l);
struct line_state lines_take(struct lines *l);

#endif

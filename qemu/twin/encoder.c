/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "encoder.h"

#include <string.h>

enum { CONTROL = 0x00, COUNTS = 0x04, POSITION = 0x08, LATCHED = 0x0C, INDEX = 0x10, STATUS = 0x14 };
enum { EDGE_TIME = 0x18, LATCH_TIME = 0x1C, FILTER = 0x20, HALL = 0x24, HALL_TIME = 0x28 };
enum { HALL_NOW_SHIFT = 4, FILTER_BITS = 0xFFFF };
enum { ENABLE = 1u << 0, REVERSE = 1u << 1 };
enum { INDEX_SEEN = 1u << 0, ILLEGAL = 1u << 1, SIGNAL_LOST = 1u << 2 };

#define COUNTS_AFTER_RESET 4096
#define COUNTS_MIN         4
#define COUNTS_MAX         65536

void encoder_reset(struct encoder *e, int64_t edges)
{
    bool cut = e->cut, frozen = e->frozen, reversed = e->reversed; /* the cable does not notice a reset */
    memset(e, 0, sizeof *e);
    e->counts = COUNTS_AFTER_RESET;
    e->edges = edges;
    e->frozen = frozen;
    e->reversed = reversed;
    encoder_cut(e, cut);
}

uint32_t encoder_read(const struct encoder *e, uint32_t offset)
{
    switch (offset) {
    case CONTROL:
        return e->control;
    case COUNTS:
        return e->counts;
    case POSITION:
        return e->position;
    case LATCHED:
        return e->latched;
    case INDEX:
        return e->index;
    case STATUS:
        return e->status;
    case EDGE_TIME:
        return e->latched_edge_clock;
    case LATCH_TIME:
        return e->latch_clock;
    case FILTER:
        return e->filter;
    case HALL:
        return e->hall << HALL_NOW_SHIFT | e->latched_hall;
    case HALL_TIME:
        return e->latched_hall_clock;
    default:
        return 0;
    }
}

void encoder_write(struct encoder *e, uint32_t offset, uint32_t value)
{
    if (offset == CONTROL) {
        e->control = value & (ENABLE | REVERSE);
    } else if (offset == COUNTS) {
        e->counts = value < COUNTS_MIN ? COUNTS_MIN : (value > COUNTS_MAX ? COUNTS_MAX : value);
        e->position = 0;
    } else if (offset == FILTER) {
        e->filter = value & FILTER_BITS;
    } else if (offset == STATUS) {
        e->status &= ~value;
        if (e->cut) {
            e->status |= SIGNAL_LOST;
        }
    }
}

static int64_t modulo(int64_t value, int64_t divisor)
{
    int64_t rest = value % divisor;
    return rest < 0 ? rest + divisor : rest;
}

static void move(struct encoder *e, int64_t edges)
{
    bool down = e->reversed != ((e->control & REVERSE) != 0);
    int64_t counts = down ? -edges : edges;
    e->position = (uint32_t)modulo((int64_t)e->position + counts, e->counts);
}

static bool counts(const struct encoder *e)
{
    return (e->control & ENABLE) && !e->cut && !e->frozen;
}

void encoder_follow(struct encoder *e, int64_t edges, const struct index_pulse *pulse)
{
    int64_t moved = edges - e->edges;
    if (moved == 0) {
        return;
    }
    /* The last index that was entered on the way, counted back from where the shaft is now. */
    int64_t beyond = moved > 0 ? modulo(edges - pulse->first, pulse->turn) : -modulo(pulse->last - edges, pulse->turn);
    bool crossed = moved > 0 ? beyond < moved : beyond > moved;
    e->edges = edges;
    if (!counts(e)) {
        return;
    }
    move(e, moved - (crossed ? beyond : 0));
    if (crossed) {
        e->index = e->position;
        e->status |= INDEX_SEEN;
        move(e, beyond);
    }
}

void encoder_time_edge(struct encoder *e, uint32_t clock)
{
    if (counts(e)) {
        e->edge_clock = clock;
    }
}

void encoder_miscount(struct encoder *e, int64_t edges)
{
    if (counts(e)) {
        move(e, edges);
    }
}

void encoder_show_hall(struct encoder *e, uint32_t hall, uint32_t changed_clock)
{
    e->hall_clock = e->hall == hall ? e->hall_clock : changed_clock;
    e->hall = hall;
}

void encoder_latch(struct encoder *e, uint32_t clock)
{
    e->latched = e->position;
    e->latched_edge_clock = e->edge_clock;
    e->latch_clock = clock;
    e->latched_hall = e->hall;
    e->latched_hall_clock = e->hall_clock;
}

bool encoder_faulty(const struct encoder *e)
{
    return e->status & (ILLEGAL | SIGNAL_LOST);
}

void encoder_cut(struct encoder *e, bool cut)
{
    e->cut = cut;
    if (cut) {
        e->status |= SIGNAL_LOST;
    }
}

void encoder_freeze(struct encoder *e, bool frozen)
{
    e->frozen = frozen;
}

void encoder_reverse(struct encoder *e, bool reversed)
{
    e->reversed = reversed;
}

void encoder_illegal(struct encoder *e)
{
    if (counts(e)) {
        e->status |= ILLEGAL;
    }
}

void encoder_slip(struct encoder *e, int64_t counts)
{
    move(e, counts);
}

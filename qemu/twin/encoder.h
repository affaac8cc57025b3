/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Fabric slot 2: the incremental encoder counter and the Hall inputs (docs/fabric.md), and what can go wrong on its cable. */
#ifndef TWIN_ENCODER_H
#define TWIN_ENCODER_H

#include <stdbool.h>
#include <stdint.h>

struct encoder {
    uint32_t control, counts, status;
    uint32_t position, latched, index;
    uint32_t edge_clock;                      /* when the last edge was counted */
    uint32_t latched_edge_clock, latch_clock; /* the same and the present, as of the last trigger */
    uint32_t filter;                          /* kept; inputs of this model are clean */
    uint32_t hall, latched_hall;              /* the Hall switches now, and as of the last trigger */
    uint32_t hall_clock, latched_hall_clock;  /* when they changed, and as of the last trigger */
    int64_t edges;                            /* of A and B that have been seen, signed */
    bool cut;                                 /* a pair is not driven */
    bool reversed;                            /* A and B are exchanged */
    bool frozen;                              /* A and B stand still whatever the shaft does */
};

void encoder_reset(struct encoder *e, int64_t edges);
uint32_t encoder_read(const struct encoder *e, uint32_t offset);
void encoder_write(struct encoder *e, uint32_t offset, uint32_t value);

/* Where the index pulse is high: from the edge `first` through `last` of every turn of `turn` edges. */
struct index_pulse {
    int64_t first, last, turn;
};

/* The shaft has moved to `edges`. INDEX is taken where the pulse rises: at its first edge, or at its last when the shaft
 * turns backwards. */
void encoder_follow(struct encoder *e, int64_t edges, const struct index_pulse *pulse);
/* Of the edges just followed, the last came at this clock of the fabric. */
void encoder_time_edge(struct encoder *e, uint32_t clock);
/* On the last way some edges were lost (negative, the shaft turning forwards) or counted twice. */
void encoder_miscount(struct encoder *e, int64_t edges);
/* The Hall switches as they are, and when they came to be so if they have changed since they were shown last. */
void encoder_show_hall(struct encoder *e, uint32_t hall, uint32_t changed_clock);
void encoder_latch(struct encoder *e, uint32_t clock);
/* ILLEGAL or SIGNAL_LOST. */
bool encoder_faulty(const struct encoder *e);

void encoder_cut(struct encoder *e, bool cut);
void encoder_freeze(struct encoder *e, bool frozen);
void encoder_reverse(struct encoder *e, bool reversed);
void encoder_illegal(struct encoder *e);
void encoder_slip(struct encoder *e, int64_t counts);

#endif

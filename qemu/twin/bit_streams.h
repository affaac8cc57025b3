/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The bit streams of the three phases' modulators, for an RTL that is clocked after the physics: what they see is kept as
 * straight lines over the steps of the physics, until the RTL's modulator clock rises there. */
#ifndef TWIN_BIT_STREAMS_H
#define TWIN_BIT_STREAMS_H

#include <stdbool.h>
#include <stdint.h>

#include "modulator.h"
#include "random.h"

#define STRETCHES_ROOM 4096 /* a power of two */

/* A step of the physics: inputs in full scales. */
struct stretch {
    double from_ps, to_ps, from[3], to[3];
};

struct bit_streams {
    struct modulator modulator[3];
    double noise; /* of an input, rms at each bit, in full scales */
    struct random random;
    struct stretch list[STRETCHES_ROOM];
    unsigned first, count;
    double lost_ps; /* up to here stretches were given up for lack of room */
};

void bit_streams_init(struct bit_streams *s, double noise, uint64_t seed);
/* The newest stretch; the oldest goes if there is no room. */
void bit_streams_follow(struct bit_streams *s, const struct stretch *newest);
/* The modulators' clock rises: their next bits, C B A. Times never decrease. */
unsigned bit_streams_clock(struct bit_streams *s, double at_ps);
/* Whether the inputs at that time are gone. */
bool bit_streams_forgot(const struct bit_streams *s, double at_ps);

#endif

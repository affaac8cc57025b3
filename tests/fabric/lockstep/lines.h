/* SPDX-License-Identifier: MIT */
/* The lines of encoder and Hall switches as they reach the counter: docs/fabric3.md, FILTER, written down once more. The twin's
 * model has clean inputs, so the bench filters for it. */
#ifndef TESTS_FABRIC_LINES_H
#define TESTS_FABRIC_LINES_H

#include <cstdint>

#include "random.h"

/* Two flip-flops, then the level follows what has differed from it for `length` ticks and one clock more. */
struct line {
    bool first = false, second = false, level = false;
    uint8_t held = 0;

    bool will_rise(uint8_t length) const
    {
        return second && !level && held >= length;
    }

    void clock(bool pin, uint8_t length, bool tick)
    {
        bool differs = second != level, follows = differs && held >= length;
        level = follows ? second : level;
        held = !differs || follows ? 0 : (uint8_t)(held + tick);
        second = first;
        first = pin;
    }
};

/* A shaft that walks at random, and the pins it drives. The index pulse stands over a few edges of a turn. */
struct shaft {
    int64_t edges = 0;
    unsigned phase = 0; /* of A and B, 0 to 3; apart from the edges by those that came two at once */
    int way = 1;
    uint32_t rest = 50; /* clocks until the next edge */
    uint32_t gap = 20;  /* between two, at most, in this run */
    unsigned hall = 0;
    bool both = false; /* A and B have just changed together */

    static constexpr int64_t TURN = 40, FIRST = 7, LAST = 9;

    void clock(random_source &r)
    {
        both = false;
        if (r.one_in(400)) {
            hall ^= 1u << r.below(3);
        }
        if (rest > 0) {
            rest--;
            return;
        }
        rest = r.below(gap);
        way = r.one_in(6) ? -way : way;
        if (r.one_in(300)) {
            phase ^= 2;
            both = true;
            return;
        }
        edges += way;
        phase = (phase + (unsigned)way) & 3;
    }

    /* Up is A before B. */
    bool a() const
    {
        return phase == 1 || phase == 2;
    }
    bool b() const
    {
        return phase == 2 || phase == 3;
    }
    bool index() const
    {
        int64_t place = ((edges % TURN) + TURN) % TURN;
        return place >= FIRST && place <= LAST;
    }
};

#endif

/* SPDX-License-Identifier: MIT */
/* Random accesses to the registers of one axis: any address now and then, most often one that does something. */
#ifndef TESTS_FABRIC_TRAFFIC_H
#define TESTS_FABRIC_TRAFFIC_H

#include <cstdint>

#include "random.h"

struct bus_access {
    bool writes;
    uint32_t offset, value;
};

/* What a run is like: how long its carrier and dead times are, how busy its bus. */
struct manner {
    uint32_t period, dead, pulse, gap;
    uint32_t watch; /* clocks; 0: not started */
    bool dozes;     /* after a few samples there are none for long: the chopper's newest grows old */
};

manner any_manner(random_source &r);
/* The n-th of those that set a run up; false: there are no more. */
bool first_access(random_source &r, const manner &m, unsigned n, bus_access *a);
/* Clocks of rest after the n-th access of a run. */
uint32_t rest_after(random_source &r, const manner &m, unsigned n);
/* `proof`: the next word that the watch takes. */
bus_access any_access(random_source &r, const manner &m, uint32_t proof);

#endif

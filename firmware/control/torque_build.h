/* SPDX-License-Identifier: MIT */
/*
 * Builds both tables of torque.h from parameters and tuning, at `on`, in parts, between which the thread serves its interfaces.
 * Total cycles and those of the longest part: rows `torque_build` and `torque_build.part` of docs/benchmarks.md.
 */
#ifndef FIRMWARE_CONTROL_TORQUE_BUILD_H
#define FIRMWARE_CONTROL_TORQUE_BUILD_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/torque.h"
#include "firmware/control/weakening.h"
#include "firmware/settings/mtpa.h"

enum torque_part {
    TORQUE_BUILDS_MAP,
    TORQUE_BUILDS_ORDINARY, /* for the ordinary handlers, which may be enough */
    TORQUE_BUILDS_WEAKENING,
};

/* Progress of the tables. */
struct torque_builder {
    enum torque_part part;
    bool lacks_weakening; /* at the end: speed_max needs field weakening, which this build leaves out */
    int32_t vbus_q15;
    struct torque_map_builder map;
    struct weakening_builder weakening;
};

/*
 * Begins both tables for the present bus voltage; each torque_build_step() builds a part and returns whether there is more. The
 * last one sets t->weakens and what follows from it. Until then the tables are invalid. Parameters and tuning must not change
 * meanwhile, and the tuning must be derived from these parameters. Thread, bridge off.
 */
void torque_build_begin(struct torque_builder *b, struct torque_control *s, const struct params *p,
                        const struct tuning *t, int32_t vbus_q15);
bool torque_build_step(struct torque_builder *b, struct torque_control *s, const struct params *p, struct tuning *t);

#endif

/* SPDX-License-Identifier: MIT */
/*
 * From parameters and their tuning to both tables of torque.h, at `on`, in parts, between which the thread serves its lines.
 * Cycles of all and of the longest part: rows `torque_build` and `torque_build.part` of docs/benchmarks.md.
 */
#ifndef FIRMWARE_CONTROL_TORQUE_BUILD_H
#define FIRMWARE_CONTROL_TORQUE_BUILD_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/torque.h"
#include "firmware/control/weakening.h"
#include "firmware/settings/torque_map.h"

enum torque_part {
    TORQUE_BUILDS_MAP,
    TORQUE_BUILDS_ORDINARY, /* what the ordinary handlers can do, which may be enough */
    TORQUE_BUILDS_WEAKENING,
};

/* How far the tables are. */
struct torque_builder {
    enum torque_part part;
    int32_t vbus_q15;
    struct torque_map_builder map;
    struct weakening_builder weakening;
};

/*
 * Begins both tables, for the bus voltage as it is now; each torque_go_on() is a part of them and returns whether there is
 * more. The last one has set t->weakens and what follows from it. Until then the tables hold nothing of use. Parameters and
 * tuning are the same ones throughout, the latter worked out from the former. Thread, bridge off.
 */
void torque_begin(struct torque_builder *b, struct torque_control *s, const struct params *p, const struct tuning *t,
                  int32_t vbus_q15);
bool torque_go_on(struct torque_builder *b, struct torque_control *s, const struct params *p, struct tuning *t);

#endif

/* SPDX-License-Identifier: MIT */
/*
 * Limits how fast a field may pull the rotor before the encoder is verified. A rotor opposite the field would swing towards it
 * with 2 w0; so the current fades as the rotor nears the speed that the tuning allows, and is zero beyond. Only the magnitude
 * of the speed counts: it is right with the encoder reversed, phases swapped, or wrong pole pairs.
 * Once past the field the current brakes, and all of it is allowed: the magnets then drive it, and their voltage along the
 * field opposes it, e_d = v_d - R i_d < 0. At zero current, where this must be decided, R need not be right.
 */
#ifndef FIRMWARE_COMMISSION_PULL_SPEED_H
#define FIRMWARE_COMMISSION_PULL_SPEED_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/current_loop.h"
#include "firmware/settings/tuning.h"

struct pull_speed {
    int32_t speed_q32; /* electrical turns per millisecond, over tuning.align_speed_ms */
    int32_t i_d_q15;   /* at the sample of the loop's v_d_q15 */
    int32_t drop_q15;  /* of the resistance */
    int32_t e_d_q15;   /* EMF along the field in the millisecond that ended */
    int32_t along_q15; /* the same, filtered; 0 while the current changes */
    bool brakes;       /* the rotor has passed the field and slows down since */
    int32_t slowest_q32;
    int32_t free_ms;    /* how long it has been fast and without current */
    int32_t let_go_q32; /* the lowest speed since then */
};

/* `moved_q32`: electrical travel by the encoder in the millisecond that ends. Slow loop. */
void pull_speed_step(struct pull_speed *s, const volatile struct current_loop *c, const struct tuning *t,
                     int32_t moved_q32);

/* The part of the current that pulls no faster than that speed. Slow loop. */
int32_t pull_speed_current_q15(const struct pull_speed *s, const struct tuning *t, int32_t current_q15);

/* The field moves: the EMF then tells nothing. Slow loop. */
void pull_speed_field_moves(struct pull_speed *s);

/* True if it is fast and accelerates without current: a load drives it. Slow loop. */
bool pull_speed_falls(const struct pull_speed *s, const struct tuning *t);

#endif

/* SPDX-License-Identifier: MIT */
/*
 * How fast a field may pull the rotor before the encoder is known to tell the truth. A rotor opposite to the field would swing
 * towards it with 2 w0; so the current fades as the rotor nears the speed that the tuning allows, and is none beyond. Only the
 * size of the speed counts: that is right with the encoder reversed or phases exchanged, and with other pole pairs than told.
 * Once past the field the current brakes, and there may be all of it: the magnets then drive it, and their voltage along the
 * field is against it, e_d = v_d - R i_d < 0. At no current, where that has to be told, R need not be right.
 */
#ifndef FIRMWARE_COMMISSION_PULL_SPEED_H
#define FIRMWARE_COMMISSION_PULL_SPEED_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/current_loop.h"
#include "firmware/settings/tuning.h"

struct pull_speed {
    int32_t speed_q32; /* electrical turns per millisecond, over tuning.align_way_ms */
    int32_t i_d_q15;   /* at the sample that v_d_q15 of the loop is of */
    int32_t drop_q15;  /* of the resistance */
    int32_t e_d_q15;   /* what the magnets induced along the field in the millisecond that ended */
    int32_t along_q15; /* the same, filtered; 0 while the current changes */
    bool brakes;       /* the rotor was seen to have passed the field, and slows since then */
    int32_t slowest_q32;
    int32_t free_ms;    /* since it is fast and without current */
    int32_t let_go_q32; /* the lowest speed since then */
};

/* `moved_q32`: electrical way by the encoder in the millisecond that ends. Slow loop. */
void pull_speed_step(struct pull_speed *s, const volatile struct current_loop *c, const struct tuning *t,
                     int32_t moved_q32);

/* As much of the current as pulls no further than to that speed. Slow loop. */
int32_t pull_speed_current_q15(const struct pull_speed *s, const struct tuning *t, int32_t current_q15);

/* The field moves: what is induced then tells nothing. Slow loop. */
void pull_speed_field_moves(struct pull_speed *s);

/* It is fast and gains speed without current: a load drives it. Slow loop. */
bool pull_speed_falls(const struct pull_speed *s, const struct tuning *t);

#endif

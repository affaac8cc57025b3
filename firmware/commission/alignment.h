/* SPDX-License-Identifier: MIT */
/*
 * Where the magnets are: an incremental encoder does not know, so a direct current pulls the rotor to a known angle.
 *
 * The current rises at -90 degrees electrical, the field turns to 0 and waits. A rotor that stood exactly opposite to the
 * first angle, where there is no pull, is picked up on the way. The encoder must have followed the turn: if it has not, it is
 * dead, counts the wrong way, or pole_pairs or encoder_counts is wrong, and switching on would end in a runaway.
 */
#ifndef FIRMWARE_COMMISSION_ALIGNMENT_H
#define FIRMWARE_COMMISSION_ALIGNMENT_H

#include "firmware/control/current_loop.h"
#include "firmware/settings/tuning.h"

enum alignment_result {
    ALIGNMENT_RUNNING,
    ALIGNMENT_DONE,
    ALIGNMENT_NOT_FOLLOWED, /* the encoder did not turn with the field */
};

struct alignment {
    uint32_t time_ms;
    uint32_t encoder_before_turn_q32;
};

/* Slow loop, before the bridge is switched on. */
void alignment_start(struct alignment *a, volatile struct current_loop *c);

/* One step a millisecond, 600 in all; sets the current references and the angle. Slow loop, bridge on. */
enum alignment_result alignment_step(struct alignment *a, volatile struct current_loop *c, const struct tuning *t,
                                     int32_t speed_rpm_q4);

#endif

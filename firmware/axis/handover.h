/* SPDX-License-Identifier: MIT */
/*
 * Another source of the angle while the motor turns: encoder, Hall switches, observer, each from each. The parameter stays what
 * it is: `on` begins with angle_source again.
 *
 *   begin     what can be said at once: the mode, the parameters as `on` would look at them, whether the target shows anything
 *   look      both angles are compared over an electrical turn, within a second, by what is there already: the encoder's count,
 *             the sector of the switches, the direction of the EMF. They may be 15 degrees apart
 *   take      the slow loop looks at the margin once more and hands over right behind a sample: frame, voltages, what was
 *             measured and the integrals are turned by what the angles differ, and the vector is another one
 *
 * Until then nothing has changed, and afterwards all of it has. An encoder whose place the drive does not know, as it was
 * switched on without, gets it from the look: counts that keep their distance from the angle for a turn, and the mean of that.
 */
#ifndef FIRMWARE_AXIS_HANDOVER_H
#define FIRMWARE_AXIS_HANDOVER_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/emf.h"
#include "firmware/settings/error.h"
#include "firmware/settings/params.h"

struct axis;

#define HANDOVER_APART_DEG 15
#define HANDOVER_LOOK_MS   1000u

struct handover {
    bool under_way;
    bool asked;               /* of the slow loop */
    struct outcome outcome;   /* of the last that has ended */
    uint32_t target;          /* enum param_angle */
    int32_t speed_ki_min_q16; /* of the tuning with that source */
    /* the encoder's place, electrical, while something else tells the angle */
    bool offset_known;
    uint32_t offset_q32;
    /* the look */
    uint32_t begun_ms;
    uint32_t polled_ms; /* and how often since that millisecond began */
    uint32_t polls;
    uint32_t sequence; /* of the sample that was looked at last */
    uint32_t looks;
    uint32_t angle_q32; /* at that sample */
    int64_t way_q32;    /* since the first */
    uint32_t states;    /* of the switches that have been seen, a bit each */
    uint32_t first_q32; /* from the encoder's count to the angle, at the first; the rest relative to it: */
    int32_t least_q32, most_q32;
    int64_t sum_q32;
    int32_t apart_q32; /* the largest difference of the two angles */
    uint32_t emf_ms;   /* the millisecond of the last look at the EMF */
    struct emf emf;
};

/* Nothing is known of an encoder that does not tell the angle. Slow loop, at `on`, and when an encoder has failed. */
void handover_forget(struct handover *h);

/* The next part of a look, or of what follows from it; whether there is more. Thread. */
bool handover_go_on(struct axis *a);

/* Hands over, if it still may; handover.outcome. Slow loop, in operation. */
void handover_take(struct axis *a);

/* What forbids the target now, at this speed and in this mode. Thread or slow loop. */
struct outcome handover_forbidden(const struct axis *a, uint32_t target);

#endif

/* SPDX-License-Identifier: MIT */
/*
 * Changes the source of the angle while the motor turns: encoder, Hall switches, observer, from any to any. The parameter stays
 * as it is: `on` begins with angle_source again.
 *
 *   begin     checks what can be checked immediately: mode, parameters as for `on`, whether the target source gives a signal
 *   compare   compares both angles over an electrical turn, within a second, from available signals: encoder count,
 *             the sector of the switches, the direction of the EMF. They may be 15 degrees apart
 *   take      the slow loop checks the margin again and hands over right after a sample: it turns frame, voltages,
 *             measurements and integrals by the difference of the angles, and changes the vector
 *
 * Until then nothing changes. If the drive was switched on without the encoder, so that its offset is unknown, the comparison
 * finds it: the mean difference between angle and count over a turn, if that difference is constant.
 */
#ifndef FIRMWARE_DRIVE_HANDOVER_H
#define FIRMWARE_DRIVE_HANDOVER_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/emf.h"
#include "firmware/settings/error.h"
#include "firmware/settings/params.h"

struct axis;

#define HANDOVER_APART_DEG  15
#define HANDOVER_COMPARE_MS 1000u

struct handover {
    bool under_way;
    bool asked;               /* requested from the slow loop */
    struct outcome outcome;   /* of the last one that ended */
    uint32_t target;          /* enum param_angle */
    int32_t speed_ki_min_q16; /* of the tuning with that source */
    /* the encoder's offset, electrical, while another source gives the angle */
    bool offset_known;
    uint32_t offset_q32;
    /* the comparison */
    uint32_t begun_ms;
    uint32_t polled_ms; /* the millisecond that `polls` counts in */
    uint32_t polls;
    uint32_t sequence; /* of the last sample compared */
    uint32_t samples;
    uint32_t angle_q32; /* at that sample */
    int64_t travel_q32; /* distance since the first */
    uint32_t states;    /* switch states seen so far, one bit each */
    uint32_t first_q32; /* from the encoder's count to the angle, at the first; the rest are relative to it: */
    int32_t min_q32, max_q32;
    int64_t sum_q32;
    int32_t apart_q32; /* largest difference between the two angles */
    uint32_t emf_ms;   /* the millisecond of the last comparison with the EMF */
    struct emf emf;
};

/* Invalidates the offset of an encoder that is not the source. Slow loop, at `on`, and when an encoder has failed. */
void handover_forget(struct handover *h);

/* Does the next part of the comparison, or of the hand-over; returns true if there is more. Thread. */
bool handover_poll(struct axis *a);

/* Hands over, if still allowed; result in handover.outcome. Slow loop, in operation. */
void handover_take(struct axis *a);

/* What forbids the target now, at this speed and in this mode. Thread or slow loop. */
struct outcome handover_forbidden(const struct axis *a, uint32_t target);

#endif

/* SPDX-License-Identifier: MIT */
/*
 * Frees the encoder's offset from load: a load shifts the rotor from the field by an angle c that no encoder sees, but that
 * changes with the current, because the torque is
 *
 *     T(I, c) = 1.5 p I sin c (psi - (Lq - Ld) I cos c)
 *
 * Measured is m = c + offset, at two currents and both ways. Friction changes sign with the direction, a load does not: summed
 * over both ways, the torques at both currents are equal at one offset only. Bisection finds it, a step a millisecond.
 */
#ifndef FIRMWARE_COMMISSION_LOAD_ANGLE_H
#define FIRMWARE_COMMISSION_LOAD_ANGLE_H

#include <stdbool.h>
#include <stdint.h>

struct load_angle {
    uint32_t forth_q32[2], back_q32[2]; /* mean of field less encoder at the larger current and at the smaller */
    int32_t ratio_q15;                  /* smaller current over the larger */
    int32_t saliency_q15;               /* (Lq - Ld) I / psi, at the larger current */
    uint32_t centre_q32;
    int32_t low_q32, high_q32; /* the offset lies between, relative to the centre */
    int32_t doubted_q32;       /* the offset if the saliency is larger than told */
    uint32_t steps;
};

/* Begins, with the measured angles and both ratios set. Slow loop. */
void load_angle_start(struct load_angle *a);

/* One step; true when the offset is known. About 300 cycles. Slow loop. */
bool load_angle_step(struct load_angle *a);

/* How far a quarter more saliency moves the offset: without a load not at all. */
uint32_t load_angle_doubt_q32(const struct load_angle *a);

/* From the encoder's angle to the magnets'. */
static inline uint32_t load_angle_offset_q32(const struct load_angle *a)
{
    return a->centre_q32 + (uint32_t)a->low_q32;
}

/*
 * Remaining difference between the torques at both currents in one direction, as an angle at the larger current: zero if there
 * is only load and friction. Stick and slip shows here.
 */
int32_t load_angle_spread_q15(const struct load_angle *a);

/* The field's lead over the rotor at the larger current, the larger of both directions. */
uint32_t load_angle_largest_q32(const struct load_angle *a);

/* T(I, c) from above, 1.0 = the torque of the larger current in a machine without saliency. */
int32_t load_angle_torque_q15(int32_t current_q15, int32_t saliency_q15, uint32_t angle_q32);

#endif

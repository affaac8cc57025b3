/* SPDX-License-Identifier: MIT */
/* For the steps that turn the rotor: waves, and a frame that follows it. Slow loop. */
#include "firmware/commission/identify_parts.h"
#include "lib/q15.h"

#define LEAST_PART     64 /* of the bus: below, dead time and noise are too much of what is induced */
#define RELUCTANT_PART 16 /* of the rated current */
#define REST_MS        50u
#define FOLLOW_MS      64    /* the offset's */
#define RADIAN_Q32     20861 /* by Q15: 2^17 / 2 pi */

void identify_play(struct identify *d, const struct measure_io *io, uint32_t field_q32, uint32_t angle_q32)
{
    d->burst.field_q32 = field_q32;
    d->burst.angle_q32 = angle_q32;
    burst_play(&d->burst, io->loop, &io->fabric->adc);
}

/*
 * A frame ahead of the rotor by x sees (sin x, cos x) times the EMF, in either direction. In addition d has -w Lq i_q: where Lq
 * is large and falls with the current, it is known only at a small current.
 */
void identify_correct_offset(const struct identify *d, const struct measure_io *io)
{
    volatile struct current_loop *const c = io->loop;
    const int32_t w_q15 = current_loop_w_q15(c);
    const int32_t cross_q15 = tuning_reactive_q15(w_q15, c->i_q_q15, io->tuning->x_q_q11);
    const int32_t d_q15 = c->v_d_q15 - ((c->i_d_q15 * io->tuning->r_q12) >> 12) + cross_q15;
    const int32_t q_q15 = q15_abs(measure_emf_q15(io));
    const bool large = q15_abs(c->i_q_q15) * RELUCTANT_PART > d->i_rated_q15;
    if (q15_max(q_q15, q15_abs(d_q15)) * LEAST_PART < c->vbus_q15 || (d->reluctant && large)) {
        return;
    }
    /* beyond 45 degrees a radian is enough to tell the way */
    const int32_t tangent_q15 = q15_abs(d_q15) >= q_q15 ? (d_q15 < 0 ? -Q15_ONE : Q15_ONE) : d_q15 * Q15_ONE / q_q15;
    const int32_t ahead_q15 = w_q15 < 0 ? -tangent_q15 : tangent_q15;
    c->angle_offset_q32 -= (uint32_t)(ahead_q15 * RADIAN_Q32 / FOLLOW_MS);
}

bool identify_stop_rotor(const struct identify *d, const struct measure_io *io, uint32_t patience_ms)
{
    return (measure_spin(io, 0, identify_i_most_q15(d)) && d->phase_ms > REST_MS) || d->phase_ms > patience_ms;
}

/* SPDX-License-Identifier: MIT */
/*
 * Runs after the current loop's four stages without an encoder: a step of the flux observer (observer.h), whose angle and speed
 * replace the encoder's. ISR, constant time.
 *
 * Ranges that exclude overflow: |i| <= 65534, |v| < 2^15, the flux within OBSERVER_FLUX_BITS; of_newest + of_older <= 2^14,
 * r_q5 <= 2^15, lq and |saliency| <= 2^14, |along| <= OBSERVER_ALONG_MOST, |back| < 2^15 with a shift of 3 at least, track <=
 * OBSERVER_TRACK_MOST. settings/tuning_observer.c and observer.c ensure this; both are tested at their limits.
 */
#ifndef FIRMWARE_CONTROL_STAGE_FLUX_H
#define FIRMWARE_CONTROL_STAGE_FLUX_H

#include "drivers/cortex/cpu.h"
#include "firmware/control/current_loop.h"
#include "lib/transform_q15.h"
#include "lib/trig.h"

#define FLUX_ERROR_SHIFT 10 /* from along times e, Q25, to Q15 */

/* Clamps to OBSERVER_FLUX_BITS. */
static inline int32_t flux_held(int32_t flux)
{
#if defined(__ARM_ARCH_7M__) && !defined(LIB_PORTABLE)
    int32_t held;
    __asm__("ssat %0, %1, %2" : "=r"(held) : "I"(OBSERVER_FLUX_BITS), "r"(flux));
    return held;
#else
    return q15_clamp(flux, -(1 << (OBSERVER_FLUX_BITS - 1)), (1 << (OBSERVER_FLUX_BITS - 1)) - 1);
#endif
}

/* The rotor's angle and speed for the next sample: prediction less its lead according to the flux. */
static inline void flux_track(struct current_loop *c, int32_t nu_q15)
{
    c->pll.speed_q32 = (int32_t)((uint32_t)c->pll.speed_q32 - (uint32_t)((c->flux.track_speed_q8 * nu_q15) >> 8));
    c->pll.angle_q32 += (uint32_t)c->pll.speed_q32 - (uint32_t)(c->flux.track * nu_q15);
}

/* One axis's flux for the next sample, before feedback: realised voltage less R i, integrated. */
static inline __attribute__((always_inline)) int32_t flux_integrated(const struct observer *o, int32_t flux, int32_t v,
                                                                     int32_t v_before, int32_t i)
{
    return flux + o->of_newest * v + o->of_older * v_before - ((o->r_q5 * i) >> 5);
}

/*
 * `i` of the sample, `v` its output, in steps. The flux less L_q i is the active flux, which lies along d:
 * e = psi_f + (L_d - L_q) i_d - (psi - L_q i).
 *
 * Integration comes first, and barriers keep the order: this frees the voltages' registers for sine and cosine. Otherwise the
 * compiler loads early and spills: 11 cycles.
 */
static inline __attribute__((always_inline)) void flux_observe(struct current_loop *c, alphabeta_t i, alphabeta_t v)
{
    struct observer *const o = &c->flux;
    cpu_compiler_barrier();
    const int32_t next_alpha = flux_integrated(o, o->flux_alpha, v.alpha, o->v_alpha_steps, i.alpha);
    const int32_t next_beta = flux_integrated(o, o->flux_beta, v.beta, o->v_beta_steps, i.beta);
    o->v_alpha_steps = v.alpha;
    o->v_beta_steps = v.beta;
    const int32_t alpha = (o->flux_alpha >> OBSERVER_FLUX_SHIFT) - ((o->lq * i.alpha) >> 15);
    const int32_t beta = (o->flux_beta >> OBSERVER_FLUX_SHIFT) - ((o->lq * i.beta) >> 15);
    cpu_compiler_barrier();
    const cossin_t cs = cossin_q15(c->pll.angle_q32);
    const int32_t i_d_q15 = (i.alpha * cs.cos + i.beta * cs.sin) >> 15;
    const int32_t e_d =
        q15_sat16(o->magnet - ((o->saliency * i_d_q15) >> 15) - ((alpha * cs.cos + beta * cs.sin) >> 15));
    const int32_t e_q = q15_sat16((alpha * cs.sin - beta * cs.cos) >> 15);
    const int32_t rho_q15 = q15_sat16((e_d * o->along_d + e_q * o->along_q) >> FLUX_ERROR_SHIFT);
    const int32_t nu_q15 = q15_sat16((e_q * o->along_d - e_d * o->along_q) >> FLUX_ERROR_SHIFT);
    const int32_t back_d = (o->back_d * rho_q15) >> 15;
    const int32_t back_q = (o->back_q * rho_q15) >> 15;
    flux_track(c, nu_q15);
    o->rho_q15 = rho_q15;
    o->flux_alpha = flux_held(next_alpha + ((back_d * cs.cos - back_q * cs.sin) >> o->back_shift));
    o->flux_beta = flux_held(next_beta + ((back_d * cs.sin + back_q * cs.cos) >> o->back_shift));
}

#endif

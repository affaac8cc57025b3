/* SPDX-License-Identifier: MIT */
/* The flux observer's other half: the slow loop's preparation for the interrupt. */
#include "firmware/control/observer.h"

#include "drivers/cortex/cpu.h"
#include "firmware/control/current_loop.h"
#include "lib/pi.h"
#include "lib/polar.h"
#include "lib/q15.h"
#include "lib/transform_q15.h"
#include "lib/trig.h"

#define OF_VOLTAGE_MOST 16384
#define BACK_SHIFT_MOST 30u
#define TWO_PI_Q11      12868 /* 2 pi */

/* sigma in |w|, Q8: while it leads, and while it follows and must find the angle in time. */
#define SIGMA_LEADING_Q8   51 /* 0.2: a flux parameter 15 % off leaves 3.4 degrees */
#define SIGMA_FOLLOWING_Q8 77 /* 0.3 */

/*
 * The tracking loop's double pole in |w|: a fifth of the margin. With a wrong R and a small margin, a fast one loses the angle;
 * with a large margin, a slow one would only lag the load.
 */
#define TRACK_BY_MARGIN    51 /* 0.2, Q8 */
#define TRACK_LEAST_Q8     77 /* 0.3 */
#define TRACK_LARGEST_Q8   384
#define TRACK_IRON_Q8      256 /* if L_q falls with the current: the slow loop reports that a millisecond late */
#define TRACK_FOLLOWING_Q8 256
#define CALM_TURNS         2
#define CALM_Q24           ((TRACK_LARGEST_Q8 - TRACK_LEAST_Q8) << 16)
#define TRACK_LEAST        40 /* 20 rad/s at 20 kHz: it never stops */

/*
 * With little current, below an eighth of the largest, the sign of the dead time's effect is unknown, and up to a 64th of the
 * bus more is in doubt: without current abb_m2bj100l lost its rotor at 4 % of the bus.
 */
#define IDLE_BUS_SHIFT  6
#define IDLE_I_SHIFT    3
#define RIPPLED_I_SHIFT 1 /* if ripple reverses a current within a period, more must flow */
#define MARGIN_MOST_Q8  (255 << 8)
#define SMOOTH_SHIFT    3 /* of |i|: 8 ms */

/* L_q falls with the current, nearly by a straight line: within 6 % for the reluctance machines in qemu/motors. */
static int32_t lq_at(const struct tuning *t, int32_t i_q_q15)
{
    if (t->observer.lq_more == 0) {
        return t->observer.lq;
    }
    const int32_t rest_q15 = t->observer.iron_q15 - q15_abs(i_q_q15);
    return q15_max(t->observer.lq + t->observer.lq_more * rest_q15 / t->observer.iron_q15, t->observer.lq / 2);
}

/* psi_a for these currents, flux 14. */
static dq_t active_flux(const struct tuning *t, dq_t i)
{
    const int32_t saliency = lq_at(t, i.q) - t->observer.ld;
    return (dq_t){t->observer.magnet - ((saliency * i.d) >> 15), (saliency * i.q) >> 15};
}

/* The currents in the estimated rotor frame. */
static dq_t currents(const volatile struct current_loop *c)
{
    const alphabeta_t in_frame = {q15_sat16(c->i_d_q15), q15_sat16(c->i_q_q15)};
    return park_q15(in_frame, cossin_q15(c->pll.angle_q32 - current_loop_angle_q32(c)));
}

/* The direction of psi_a, Q14, and the values that follow from its length. */
static dq_t resolve_active_flux(volatile struct observer *o, dq_t active)
{
    const int32_t size = q15_max(magnitude_q15(active.d, active.q), OBSERVER_ALONG_ONE / OBSERVER_ALONG_MAX);
    const int32_t by_size = OBSERVER_ALONG_ONE / size;
    const dq_t direction_q14 = {active.d * (1 << 14) / size, active.q * (1 << 14) / size};
    o->along_d = (direction_q14.d * by_size) >> 14;
    o->along_q = (direction_q14.q * by_size) >> 14;
    o->active = size;
    return direction_q14;
}

/*
 * back = 2 sigma Ts |psi_a| 2^(shift - 1), sigma in |w|. The shift gives it 15 bits at any speed, so rounding does not hide
 * small corrections.
 */
static void set_flux_feedback(volatile struct observer *o, dq_t direction_q14, uint32_t speed_q32, uint32_t sigma_q8)
{
    const uint64_t turn_q32 = ((uint64_t)speed_q32 * (sigma_q8 * TWO_PI_Q11)) >> 18; /* 2 sigma Ts */
    const uint32_t of_16 = (uint32_t)((turn_q32 * (uint32_t)o->active) >> 17);       /* for a shift of 16 */
    const int32_t bits = 32 - __builtin_clz(of_16 | 1u);
    const int32_t more = q15_min(15 - bits, BACK_SHIFT_MOST - 16);
    const int32_t back = (int32_t)(more >= 0 ? of_16 << more : of_16 >> -more);
    o->back_d = (back * direction_q14.d) >> 14;
    o->back_q = (back * direction_q14.q) >> 14;
    o->back_shift = (uint32_t)(16 + more);
}

int32_t observer_quickest_q8(const struct tuning *t)
{
    return t->observer.lq_more != 0 ? TRACK_IRON_Q8 : TRACK_LARGEST_Q8;
}

static void set_tracking(volatile struct observer *o, uint32_t speed_q32, int32_t pole_q8, enum observer_role role)
{
    const uint32_t wanted = (uint32_t)(((uint64_t)speed_q32 * (uint32_t)pole_q8) >> 22); /* 2 a Ts / 2 pi, times 2^17 */
    const int32_t track = q15_clamp((int32_t)wanted, TRACK_LEAST, OBSERVER_TRACK_MAX);
    o->track_speed_q8 = role == OBSERVER_LEADS ? (int32_t)(((uint32_t)(track * track) * 201u) >> 16) : 0;
    o->track = track;
}

static int32_t dead_time_doubt_q15(const struct tuning *t, int32_t i_q15, int32_t vbus_q15)
{
    const int32_t idle_q15 = (t->i_max_q15 >> (t->ripple_q10 != 0 ? RIPPLED_I_SHIFT : IDLE_I_SHIFT)) + 1;
    const int32_t missing_q15 = q15_max(idle_q15 - i_q15, 0);
    return (vbus_q15 >> OBSERVER_BUS_UNCERTAINTY_SHIFT) + (vbus_q15 >> IDLE_BUS_SHIFT) * missing_q15 / idle_q15;
}

static int32_t by_doubt_q8(const struct tuning *t, int32_t emf_q15, int32_t i_q15, int32_t vbus_q15)
{
    const int32_t drop_q15 = (((i_q15 * OBSERVER_R_UNCERTAINTY_Q8) >> 8) * t->r_q12) >> 12;
    const int32_t uncertainty_q15 = drop_q15 + dead_time_doubt_q15(t, i_q15, vbus_q15) + 1;
    return q15_min((int32_t)(((uint32_t)emf_q15 << 8) / (uint32_t)uncertainty_q15), MARGIN_MOST_Q8);
}

/* m = |w| psi_a / (dR |i| + dU), all of them voltages in Q15 of v_range. */
static void estimate_margin(volatile struct observer *o, const struct tuning *t, dq_t i, int32_t w_q15,
                            int32_t vbus_q15)
{
    o->i_q4 += (magnitude_q15(i.d, i.q) * 16 - o->i_q4) >> SMOOTH_SHIFT;
    o->i_q_q4 += (q15_abs(i.q) * 16 - o->i_q_q4) >> SMOOTH_SHIFT;
    const int32_t emf_q12 = (int32_t)((uint32_t)(t->emf_q12 * o->active) / (uint32_t)t->observer.magnet);
    const int32_t emf_q15 = (q15_abs(w_q15) * q15_min(emf_q12, 65535)) >> 12;
    o->margin_q8 = by_doubt_q8(t, emf_q15, o->i_q4 >> 4, vbus_q15);
    /* torque, and with it current, may vanish a moment later */
    o->margin_torque_q8 =
        q15_min(by_doubt_q8(t, emf_q15, o->i_q_q4 >> 4, vbus_q15), by_doubt_q8(t, emf_q15, 0, vbus_q15));
}

int32_t observer_margin_q8(const struct tuning *t, int32_t i_q15, int32_t w_q15, int32_t vbus_q15)
{
    return by_doubt_q8(t, (q15_abs(w_q15) * t->emf_q12) >> 12, i_q15, vbus_q15);
}

/* The voltage acting between two samples: margins.h. In halves of the newest one and of the one before. */
static void weigh_voltages(volatile struct observer *o, const struct tuning *t, int32_t vbus_q15)
{
    const int32_t whole = (int32_t)(((int64_t)t->observer.of_bus_q8 * vbus_q15) >> 23);
    const int32_t of_both = q15_min(whole, OF_VOLTAGE_MOST);
    o->of_older = of_both * (t->delay_halves - 1) / 2;
    o->of_newest = of_both - o->of_older;
}

static void update_machine(volatile struct observer *o, const struct tuning *t, int32_t i_q_q15)
{
    o->magnet = t->observer.magnet;
    o->lq = lq_at(t, i_q_q15);
    o->saliency = o->lq - t->observer.ld;
    o->r_q5 = t->observer.r_q5;
}

void observer_reset(volatile struct current_loop *c, const struct tuning *t, uint32_t angle_q32, int32_t i_d_q15)
{
    volatile struct observer *const o = &c->flux;
    const cossin_t cs = cossin_q15(angle_q32);
    const int32_t size = t->observer.magnet + ((t->observer.ld * i_d_q15) >> 15);
    const uint32_t mask = cpu_irq_save();
    o->flux_alpha = (size * cs.cos) >> (15 - OBSERVER_FLUX_SHIFT);
    o->flux_beta = (size * cs.sin) >> (15 - OBSERVER_FLUX_SHIFT);
    current_loop_set_rotor(c, angle_q32);
    cpu_irq_restore(mask);
}

void observer_preset(volatile struct current_loop *c, const struct tuning *t)
{
    volatile struct observer *const o = &c->flux;
    const dq_t i = currents(c);
    const int32_t d = t->observer.magnet + ((t->observer.ld * i.d) >> 15);
    const int32_t q = (lq_at(t, i.q) * i.q) >> 15;
    const uint32_t mask = cpu_irq_save();
    const cossin_t cs = cossin_q15(c->pll.angle_q32);
    const int32_t v_d = c->integral_d_q9 >> PI_SHIFT;
    o->flux_alpha = (d * cs.cos - q * cs.sin) >> (15 - OBSERVER_FLUX_SHIFT);
    o->flux_beta = (d * cs.sin + q * cs.cos) >> (15 - OBSERVER_FLUX_SHIFT);
    o->v_alpha_steps = (v_d * cs.cos - c->v_q_steps * cs.sin) >> 15;
    o->v_beta_steps = (v_d * cs.sin + c->v_q_steps * cs.cos) >> 15;
    cpu_irq_restore(mask);
}

void observer_slow_down(volatile struct current_loop *c)
{
    c->flux.slow_down_q24 = CALM_Q24;
}

/* The tracking loop's pole, in |w|; calm decays with the turns. */
static int32_t pole_q8(volatile struct current_loop *c, const struct tuning *t, uint32_t speed_q32)
{
    volatile struct observer *const o = &c->flux;
    const int32_t by_margin_q8 =
        q15_clamp((o->margin_q8 * TRACK_BY_MARGIN) >> 8, TRACK_LEAST_Q8, observer_quickest_q8(t));
    const int32_t slow_down_q24 = o->slow_down_q24;
    if (slow_down_q24 == 0) {
        return by_margin_q8;
    }
    const int32_t turns_q16 = (int32_t)((speed_q32 >> 8) * (uint32_t)c->loops_per_slow >> 8);
    o->slow_down_q24 = q15_max(slow_down_q24 - turns_q16 * (CALM_Q24 >> 16) / CALM_TURNS, 0);
    return q15_max(q15_min(by_margin_q8, TRACK_LARGEST_Q8 - (slow_down_q24 >> 16)), TRACK_LEAST_Q8);
}

void observer_begin(volatile struct current_loop *c, const struct tuning *t)
{
    const dq_t i = currents(c);
    c->flux.i_q4 = magnitude_q15(i.d, i.q) * 16;
    c->flux.i_q_q4 = q15_abs(i.q) * 16;
    observer_follow(c, t, OBSERVER_LEADS);
}

void observer_follow(volatile struct current_loop *c, const struct tuning *t, enum observer_role role)
{
    volatile struct observer *const o = &c->flux;
    const uint32_t speed_q32 = (uint32_t)q15_abs(c->pll.speed_q32);
    const dq_t i = currents(c);
    const dq_t direction_q14 = resolve_active_flux(o, active_flux(t, i));
    update_machine(o, t, i.q);
    weigh_voltages(o, t, c->vbus_q15);
    estimate_margin(o, t, i, current_loop_w_q15(c), c->vbus_q15);
    set_flux_feedback(o, direction_q14, speed_q32, role == OBSERVER_LEADS ? SIGMA_LEADING_Q8 : SIGMA_FOLLOWING_Q8);
    if (role == OBSERVER_RESTS) {
        return;
    }
    set_tracking(o, speed_q32, role == OBSERVER_LEADS ? pole_q8(c, t, speed_q32) : TRACK_FOLLOWING_Q8, role);
}

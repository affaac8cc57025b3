/* SPDX-License-Identifier: MIT */
#include "firmware/monitor/hall_watch.h"

#include "drivers/cortex/cpu.h"
#include "firmware/axis/axis.h"
#include "firmware/control/emf.h"
#include "lib/q15.h"

#define INVALID_SAMPLES 2u /* in a millisecond: at top speed a state lasts longer */
#define OFF_Q32         (15u * 11930464u)
#define AT_END_Q32      (1 << 24) /* 1.4 degrees */
#define EMF_SHIFT       4         /* 16 ms */
#define EMF_WRONG_MS    60u
#define DOUBT_BUS_SHIFT 6 /* dead time */

/* ---- where the rotor is ---- */

/* By the frame, at the last sample. */
static struct rotor_seed by_switches(const struct axis *a)
{
    const volatile struct current_loop *const c = &a->loop;
    const uint32_t mask = cpu_irq_save();
    const int32_t speed_q32 = c->pll.speed_q32;
    const struct rotor_seed now = {.angle_q32 = current_loop_angle_q32(c) - (uint32_t)speed_q32,
                                   .clock = encoder_latch_clock(&a->fabric->encoder),
                                   .speed_q32 = speed_q32};
    cpu_irq_restore(mask);
    return now;
}

static uint32_t expected_q32(const struct axis *a, uint32_t clock)
{
    const struct rotor_seed *const s = &a->hall_watch.sound;
    const uint32_t loop_counts = (uint32_t)a->tuning.loop_counts;
    return s->angle_q32 + (clock - s->clock + loop_counts / 2u) / loop_counts * (uint32_t)s->speed_q32;
}

static bool far_off(uint32_t angle_q32, uint32_t from_q32)
{
    return angle_q32 - from_q32 + OFF_Q32 > 2u * OFF_Q32;
}

/* The angle waits for an edge at the end of its sector. */
static bool waits_for_edge(const struct axis *a, const struct rotor_seed *now)
{
    const struct hall_sector *const s = &a->hall.sector[((const volatile struct hall *)&a->hall)->state];
    const int32_t off_q32 = (int32_t)(now->angle_q32 - s->middle_q32);
    return (now->speed_q32 < 0 ? (int32_t)(0u - (uint32_t)off_q32) : off_q32) > s->half_q32 - AT_END_Q32;
}

/* Distance by the earlier speed or by the switches, whichever is more: a starting rotor is soon believed. */
static bool for_a_turn(struct axis *a, const struct rotor_seed *now)
{
    struct hall_watch *const w = &a->hall_watch;
    const int32_t speed_q32 = q15_max(q15_abs(w->sound.speed_q32), q15_abs(now->speed_q32));
    w->doubt_q16 += ((uint32_t)speed_q32 >> 8) * (uint32_t)a->tuning.loops_per_slow >> 8;
    return w->doubt_q16 >> 16 != 0u;
}

/* A wrong edge affects the speed for longer than the angle: so no other is used for a turn. */
static bool doubts(struct axis *a, const struct rotor_seed *now, bool far)
{
    struct hall_watch *const w = &a->hall_watch;
    if (w->doubt_ms == 0u) {
        w->doubt_q16 = 0;
        return far && w->sound.speed_q32 != 0;
    }
    return !for_a_turn(a, now);
}

static void hall_watch_follow(struct axis *a)
{
    struct hall_watch *const w = &a->hall_watch;
    const struct rotor_seed now = by_switches(a);
    const uint32_t angle_q32 = expected_q32(a, now.clock);
    const bool far = far_off(now.angle_q32, angle_q32);
    const bool doubt = doubts(a, &now, far);
    w->doubt_ms = doubt ? w->doubt_ms + 1u : 0u;
    if (doubt || (waits_for_edge(a, &now) && !far)) {
        w->sound.angle_q32 = angle_q32;
        w->sound.clock = now.clock;
    } else {
        w->sound = now;
    }
    w->torque_q29 = doubt ? w->torque_q29 : a->speed.integral_q29;
}

int32_t hall_watch_torque_q29(const struct axis *a)
{
    return a->hall_watch.doubt_ms != 0u ? a->hall_watch.torque_q29 : a->speed.integral_q29;
}

/* ---- what they show ---- */

static void take_counts(struct axis *a)
{
    const volatile struct hall *const h = &a->hall;
    a->hall_watch.invalid = h->invalid;
    a->hall_watch.skipped = h->skipped;
}

/* ---- where the EMF is ---- */

/* A hot winding has two fifths more resistance than was told; what three quarters of its voltage leave is told apart. */
static bool emf_is_elsewhere(struct axis *a)
{
    struct hall_watch *const w = &a->hall_watch;
    const int32_t w_q15 = current_loop_w_q15(&a->loop);
    const int32_t drop_q15 = (a->tuning.r_q12 * q15_abs(a->loop.i_q_q15)) >> 12;
    const int32_t hidden_q15 = drop_q15 - drop_q15 / 4 + (a->loop.vbus_q15 >> DOUBT_BUS_SHIFT);
    w->emf_q4 += (emf_along_q15(&a->loop, &a->tuning, w_q15) * 16 - w->emf_q4) >> EMF_SHIFT;
    w->expected_q4 += (emf_expected_q15(&a->tuning, w_q15) * 16 - w->expected_q4) >> EMF_SHIFT;
    const bool tells = w->expected_q4 > 16 * hidden_q15;
    return tells && w->emf_q4 < w->expected_q4 / 2;
}

static void watch_emf(struct axis *a)
{
    struct hall_watch *const w = &a->hall_watch;
    const bool wrong = emf_is_elsewhere(a);
    w->wrong_ms = wrong ? w->wrong_ms + 1u : (w->wrong_ms > 0u ? w->wrong_ms - 1u : 0u);
    if (w->wrong_ms >= EMF_WRONG_MS) {
        w->wrong_ms = 0;
        fault_report(a, FAULT_HALL_SEQUENCE, (int32_t)encoder_hall_latched(&a->fabric->encoder), 0);
    }
}

void hall_watch_begin(struct axis *a)
{
    a->hall_watch = (struct hall_watch){.sound = by_switches(a)};
    take_counts(a);
}

void hall_watch_step(struct axis *a)
{
    const uint32_t invalid = a->hall_watch.invalid;
    const uint32_t skipped = a->hall_watch.skipped;
    take_counts(a);
    hall_watch_follow(a);
    if (a->hall_watch.invalid - invalid >= INVALID_SAMPLES) {
        fault_report(a, FAULT_HALL_INVALID, (int32_t)encoder_hall_latched(&a->fabric->encoder), 0);
    } else if (a->hall_watch.skipped != skipped) {
        fault_report(a, FAULT_HALL_SEQUENCE, (int32_t)encoder_hall_latched(&a->fabric->encoder), 0);
    } else {
        watch_emf(a);
    }
}

enum fault hall_watch_blame(const struct axis *a, enum fault seen)
{
    const struct rotor_seed now = by_switches(a);
    const bool running = a->state == AXIS_OPERATION_ENABLED && a->loop.source == LOOP_HALL;
    return running && far_off(now.angle_q32, expected_q32(a, now.clock)) ? FAULT_HALL_SEQUENCE : seen;
}

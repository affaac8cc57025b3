/* SPDX-License-Identifier: MIT */
/* The slow loop's part of a hand-over: makes all changes, right after a sample. */
#include "drivers/cortex/cpu.h"
#include "firmware/axis/axis.h"
#include "firmware/commission/pulses.h"
#include "firmware/drive/handover.h"
#include "firmware/drive/retune.h"
#include "firmware/source/rotor.h"

/* Cogging torque is known only with an encoder; otherwise the speed loop's memory holds it. */
static int32_t known_torque_q15(struct axis *a)
{
    const bool known = rotor_has_encoder(a) && (a->motion.cogging.count | a->tuning.friction_q15) != 0;
    return known ? modes_known_torque_q15(a) : 0;
}

static void leave(struct axis *a)
{
    struct handover *const h = &a->handover;
    if (rotor_has_encoder(a)) {
        h->offset_known = a->start.aligned;
        h->offset_q32 = a->loop.angle_offset_q32;
    }
    start_forget(a);
    a->failover.cause = FAULT_NONE;
}

/* ---- from the next sample on; interrupts are held ---- */

static void by_encoder(struct axis *a)
{
    volatile struct current_loop *const c = &a->loop;
    const uint32_t count_q32 = encoder_latched(&a->fabric->encoder) * c->encoder_scale_q32;
    const struct pll rotor = {count_q32 + (uint32_t)c->pll.speed_q32, c->pll.speed_q32};
    current_loop_hand_over(c, LOOP_ENCODER, &rotor, a->handover.offset_q32);
}

/* The frame stays where it is, and the switches keep it within its sector. */
static void by_hall(struct axis *a)
{
    volatile struct current_loop *const c = &a->loop;
    const struct pll rotor = {current_loop_angle_q32(c), c->pll.speed_q32};
    current_loop_hand_over(c, LOOP_HALL, &rotor, 0);
    hall_resume(&a->hall, c, &a->fabric->encoder, a->torque.torque_q15);
}

static void by_observer(struct axis *a)
{
    volatile struct current_loop *const c = &a->loop;
    const struct pll rotor = {current_loop_angle_q32(c), c->pll.speed_q32};
    current_loop_forget_injection(c);
    current_loop_hand_over(c, LOOP_OBSERVER, &rotor, 0);
    observer_slow_down(c);
    observer_begin(c, &a->tuning);
    observer_preset(c, &a->tuning);
}

/* ---- what follows from it ---- */

/* The shaft has turned uncounted meanwhile: the position's reference is lost. */
static void begin_encoder(struct axis *a)
{
    a->start.aligned = true;
    a->motion.homed = false;
    speed_estimate_resume(&a->speed.estimate, &a->fabric->encoder);
}

static void begin_watching(struct axis *a)
{
    if (rotor_has_hall(a)) {
        hall_watch_begin(a);
    }
    a->sensorless = (struct sensorless){.ref_rpm_q16 = a->speed.ref_rpm_q16};
    supervision_begin(a);
}

static void change(struct axis *a)
{
    const uint32_t target = a->handover.target;
    const int32_t known_q15 = known_torque_q15(a);
    emf_pulse_wait(a->fabric, 1);
    const uint32_t mask = cpu_irq_save();
    leave(a);
    if (source_has(target, SOURCE_COUNTS)) {
        by_encoder(a);
    } else if (source_has(target, SOURCE_SWITCHES)) {
        by_hall(a);
    } else {
        by_observer(a);
    }
    cpu_irq_restore(mask);
    retune_source(a, target, a->handover.speed_ki_min_q16);
    current_loop_adopt(&a->loop, a->fabric, &a->tuning);
    if (source_has(target, SOURCE_COUNTS)) {
        begin_encoder(a);
    }
    a->speed.integral_q29 += (known_q15 - known_torque_q15(a)) * (1 << 14);
    begin_watching(a);
}

void handover_take(struct axis *a)
{
    struct handover *const h = &a->handover;
    h->outcome = handover_forbidden(a, h->target);
    if (h->outcome.error == ERROR_NONE) {
        change(a);
    }
    h->under_way = false;
}

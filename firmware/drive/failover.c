/* SPDX-License-Identifier: MIT */
#include "firmware/drive/failover.h"

#include "drivers/cortex/cpu.h"
#include "firmware/axis/axis.h"
#include "firmware/drive/drive.h"
#include "firmware/drive/modes.h"
#include "firmware/drive/retune.h"
#include "firmware/source/rotor.h"
#include "lib/angle.h"
#include "lib/polar.h"
#include "lib/q15.h"

/* ==== a fault in a sample ==== */

/* The current loop's interrupt calls this when a sample has a fault: finds its cause. ISR, cold. */

/* Hall switches that gave a wrong angle are reported by their monitor later; here they are the cause only for failover. */
static enum fault blamed_for_overcurrent(const struct axis *a)
{
    if (rotor_has_encoder(a)) {
        return encoder_watch_blame(a, FAULT_OVERCURRENT);
    }
    return rotor_has_hall(a) ? hall_watch_blame(a, FAULT_OVERCURRENT) : FAULT_OVERCURRENT;
}

/* Gates off first, whatever the cause of the over-current turns out to be. */
static void raise_overcurrent(struct axis *a)
{
    int32_t phase;
    gate_disable(&a->fabric->gate);
    if (phase_watch_suspects(a, &phase)) {
        fault_raise_with(a, FAULT_OPEN_PHASE, phase, 0);
        return;
    }
    if (failover_absorbs_trip(a)) {
        return;
    }
    const enum fault cause = blamed_for_overcurrent(a);
    if (cause == FAULT_OVERCURRENT || !failover_from_sample(a, cause)) {
        fault_raise(a, rotor_has_encoder(a) ? cause : FAULT_OVERCURRENT);
    }
}

static void raise_encoder(struct axis *a)
{
    if (!failover_from_sample(a, FAULT_ENCODER)) {
        fault_raise(a, FAULT_ENCODER);
    }
}

/*
 * First cause: hardware latches before conclusions from a sample, and the cause of an over-current before the over-current.
 * Rare enough to branch.
 */
void drive_sample_fault(struct axis *a)
{
    const uint32_t gate = gate_status(&a->fabric->gate);
    const enum fault sampled = fault_from_adc(adc_status(&a->fabric->adc));
    if ((gate & GATE_STATUS_LATCHES) != 0u) {
        fault_raise(a, fault_from_gate(gate));
    } else if ((gate & GATE_STATUS_ENCODER) != 0u && rotor_has_encoder(a) && a->failover.pending == FAULT_NONE) {
        raise_encoder(a);
    } else if (sampled == FAULT_OVERCURRENT) {
        raise_overcurrent(a);
    } else if (sampled != FAULT_NONE) {
        fault_raise(a, sampled);
    } else if ((gate & GATE_STATUS_OVERRUN) != 0u) {
        fault_raise(a, FAULT_LOOP_OVERRUN);
    }
}

#define WRONG_Q32     (1u << 27) /* 11 degrees of angle error: the current was not the requested one */
#define DECAY_MS      4u         /* within this time the diodes bring any current to zero */
#define DECAYED_SHIFT 3          /* an eighth of i_max */

void failover_reset(struct axis *a)
{
    a->failover = (struct failover){.cause = FAULT_NONE, .pending = FAULT_NONE};
}

/* Position control and the cyclic modes need an encoder; the observer's handler has no field weakening. */
static bool failover_is_possible(const struct axis *a, enum fault cause)
{
    const uint32_t mode = a->mode;
    const bool suits = mode == AXIS_MODE_SPEED || mode == AXIS_MODE_TORQUE;
    return FEATURE_IN(SENSORLESS) && suits && a->reactions.choice[cause] == REACTION_CARRY &&
           a->state == AXIS_OPERATION_ENABLED && !rotor_is_sensorless(a) && a->failover.pending == FAULT_NONE &&
           a->tuning.observer.usable && !a->tuning.weakens && encoder_watch_offset_is_verified(a);
}

/* The rotor's angle at the next sample. */
static uint32_t angle_now_q32(const struct axis *a, const struct rotor_seed *s)
{
    const uint32_t loop_counts = (uint32_t)a->tuning.loop_counts;
    const uint32_t since = encoder_latch_clock(&a->fabric->encoder) - s->clock;
    return s->angle_q32 + ((since + loop_counts / 2u) / loop_counts + 1u) * (uint32_t)s->speed_q32;
}

static bool observer_reaches(const struct axis *a, int32_t speed_q32)
{
    const volatile struct current_loop *const c = &a->loop;
    const int32_t i_q15 = magnitude_q15(q15_sat16(c->i_d_ref_q15), q15_sat16(c->i_q_ref_q15));
    const int32_t w_q15 = q15_sat16(speed_q32 >> c->w_shift);
    return observer_margin_q8(&a->tuning, i_q15, w_q15, c->vbus_q15) >= OBSERVER_LEADS_Q8;
}

/* From here on the drive runs without the sensor, as if it had been switched on without one. */
static void leave_sensor(struct axis *a, enum fault cause)
{
    a->failover.cause = cause;
    a->failover.pending = FAULT_NONE;
    retune_source(a, PARAM_ANGLE_SENSORLESS, 0); /* no encoder edges */
    current_loop_forget_injection(&a->loop);
    handover_forget(&a->handover); /* the failed encoder's offset is no longer valid */
    start_forget(a);
    fault_warn(a, cause);
}

/* Recalculates the torque limits, which were for a wrong speed. */
static void update_torque_limits(struct axis *a)
{
    rotor_take_speed(a);
    torque_measure(&a->torque, &a->loop, &a->tuning, adc_vbus_q15(&a->fabric->adc));
    modes_limit_torque(a);
}

/* The speed loop's integral before the sensor became suspect. */
static int32_t torque_held_q29(const struct axis *a)
{
    return rotor_has_hall(a) ? hall_watch_torque_q29(a) : encoder_watch_torque_q29(a);
}

/* The speed loop continues from that torque, towards the same target. */
static void continue_speed_loop(struct axis *a)
{
    a->sensorless = (struct sensorless){.ref_rpm_q16 = a->speed.ref_rpm_q16};
    update_torque_limits(a);
    encoder_watch_forget(a);
    supervision_begin_again(a);
}

/* The handler has changed already: until now the observer was ignored, and the frame turned at the given speed. */
static void hand_over_to_observer(struct axis *a, enum fault cause)
{
    volatile struct current_loop *const c = &a->loop;
    a->speed.integral_q29 = torque_held_q29(a);
    leave_sensor(a, cause);
    observer_begin(c, &a->tuning);
    const uint32_t mask = cpu_irq_save();
    current_loop_place(c, c->field_angle_q32, c->field_speed_q32);
    observer_preset(c, &a->tuning);
    current_loop_follow_rotor(c);
    cpu_irq_restore(mask);
    current_loop_restart_feedforward(c, a->fabric, &a->tuning);
    continue_speed_loop(a);
}

/* Returns the frame's angle error. */
static int32_t coast(struct axis *a)
{
    const struct rotor_seed *const s = &a->failover.seed;
    const uint32_t turn_q32 = angle_now_q32(a, s) - current_loop_angle_q32(&a->loop);
    current_loop_coast(&a->loop, turn_q32, s->speed_q32);
    return (int32_t)turn_q32;
}

static int32_t torque_before_q15(const struct axis *a)
{
    return a->mode == AXIS_MODE_TORQUE ? a->torque_command_q15 : torque_held_q29(a) >> 14;
}

static struct rotor_seed seed_now(const struct axis *a, enum fault cause)
{
    struct rotor_seed seed = a->hall_watch.sound;
    if (!rotor_has_hall(a)) {
        encoder_watch_seed(a, cause, &seed);
    }
    return seed;
}

/* The same in the interrupt. */
static struct rotor_seed seed_at_sample(const struct axis *a, enum fault cause)
{
    struct rotor_seed seed = a->hall_watch.sound;
    if (!rotor_has_hall(a)) {
        encoder_watch_seed_at_sample(a, cause, &seed);
    }
    return seed;
}

/*
 * Currents and voltages were controlled at a wrong angle: start from the torque before the fault, and the EMF. The currents
 * settle in the millisecond until the observer takes over, which does not model saturation. If the index has shown the fault,
 * it is unknown since when the count is wrong: the present current may be holding the load and is kept.
 */
static void begin_anew(struct axis *a)
{
    volatile struct current_loop *const c = &a->loop;
    update_torque_limits(a);
    modes_request_torque(a, torque_before_q15(a));
    const uint32_t mask = cpu_irq_save();
    current_loop_drop_voltage(c);
    current_loop_follow(c, a->fabric, &a->tuning);
    cpu_irq_restore(mask);
}

bool failover_begin(struct axis *a, enum fault cause)
{
    const uint32_t mask =
        cpu_irq_save(); /* the interrupt may fail over meanwhile, and the seed is for the next sample */
    if (!failover_is_possible(a, cause)) {
        cpu_irq_restore(mask);
        return a->failover.pending != FAULT_NONE;
    }
    a->failover.seed = seed_now(a, cause);
    const bool reaches = observer_reaches(a, a->failover.seed.speed_q32);
    const int32_t wrong_q32 = reaches ? coast(a) : 0;
    a->failover.pending = reaches ? cause : FAULT_NONE;
    cpu_irq_restore(mask);
    if (cause != FAULT_ENCODER_COUNTS && angle_size_q32(wrong_q32) > WRONG_Q32) {
        begin_anew(a);
    }
    return reaches;
}

static void wait_for_decay(struct axis *a)
{
    gate_disable(&a->fabric->gate);
    current_loop_disarm(&a->loop);
    a->failover.waited_ms = 0;
}

bool failover_absorbs_trip(struct axis *a)
{
    const bool absorbed = FEATURE_IN(SENSORLESS) && a->failover.pending != FAULT_NONE && current_loop_is_on(&a->loop);
    if (absorbed) {
        wait_for_decay(a);
    }
    return absorbed;
}

bool failover_from_sample(struct axis *a, enum fault cause)
{
    if (!failover_is_possible(a, cause)) {
        return false;
    }
    a->failover.seed = seed_at_sample(a, cause);
    if (cause == FAULT_ENCODER) {
        (void)coast(a);
    } else {
        wait_for_decay(a);
    }
    a->failover.pending = cause;
    return true;
}

static bool has_decayed(const struct axis *a)
{
    const struct adc_sample s = adc_read(&a->fabric->adc);
    const int32_t max_q15 = a->tuning.i_max_q15 >> DECAYED_SHIFT;
    return q15_abs(s.ia_q15) < max_q15 && q15_abs(s.ib_q15) < max_q15 && q15_abs(s.ic_q15) < max_q15;
}

/* The bridge is off. The voltage for switching on is known only when the current has decayed. */
static void switch_on_again(struct axis *a, enum fault cause)
{
    a->failover.waited_ms++;
    if (!has_decayed(a) && a->failover.waited_ms < DECAY_MS) {
        return;
    }
    if (!has_decayed(a) || !observer_reaches(a, a->failover.seed.speed_q32)) {
        fault_raise(a, cause);
        return;
    }
    a->speed.integral_q29 = torque_held_q29(a);
    leave_sensor(a, cause);
    if (!current_loop_select(&a->loop, a->fabric, LOOP_OBSERVER)) {
        fault_raise(a, FAULT_FABRIC); /* the gate does not let go */
        return;
    }
    current_loop_offset(&a->loop, 0);
    flying_resume(a, angle_now_q32(a, &a->failover.seed), a->failover.seed.speed_q32);
    continue_speed_loop(a);
}

void failover_step(struct axis *a)
{
    const enum fault cause = (enum fault)a->failover.pending;
    if (a->state != AXIS_OPERATION_ENABLED || a->request == AXIS_REQUEST_OFF) { /* do not switch the gates on again */
        a->failover.pending = FAULT_NONE;
    } else if (!current_loop_is_on(&a->loop)) {
        switch_on_again(a, cause);
    } else if (observer_reaches(a, a->failover.seed.speed_q32)) {
        hand_over_to_observer(a, cause);
    } else {
        fault_raise(a, cause);
    }
}

enum fault failover_blame(const struct axis *a, enum fault seen)
{
    const uint32_t cause = a->failover.cause;
    const bool lost = seen == FAULT_LOCK_LOST || seen == FAULT_OUT_OF_STEP;
    return lost && cause != FAULT_NONE ? (enum fault)cause : seen;
}

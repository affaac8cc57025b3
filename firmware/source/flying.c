/* SPDX-License-Identifier: MIT */
#include "firmware/source/flying.h"

#include "drivers/cortex/cpu.h"
#include "firmware/axis/axis.h"
#include "firmware/commission/pulses.h"
#include "firmware/control/bridge.h"
#include "firmware/settings/config.h"
#include "firmware/source/rotor.h"
#include "lib/polar.h"
#include "lib/q15.h"

/* ---- tracking the EMF ---- */

#define NEAR_Q32  (1 << 28)
#define LOOKS_MAX 10

void emf_track_begin(struct emf_track *t, uint32_t at, uint32_t angle_q32, int32_t speed_q32)
{
    *t = (struct emf_track){.looks = 1, .at = at, .angle_q32 = angle_q32, .speed_q32 = speed_q32};
}

void emf_track_add(struct emf_track *t, uint32_t at, uint32_t angle_q32)
{
    const int32_t since = q15_max((int32_t)(at - t->at), 1);
    const uint32_t expected_q32 = emf_track_angle_q32(t, at);
    const int32_t off_q32 = (int32_t)(angle_q32 - expected_q32);
    const int32_t k = q15_min((int32_t)t->looks + 1, LOOKS_MAX);
    const int32_t share_q32 = off_q32 / (k * (k + 1));
    t->good = q15_abs(off_q32 / 2) < NEAR_Q32 / 2 ? t->good + 1u : 0u;
    t->angle_q32 = expected_q32 + (uint32_t)(share_q32 * 2 * (2 * k - 1));
    t->speed_q32 += share_q32 / since * 6;
    t->at = at;
    t->looks++;
}

void emf_track_add_any(struct emf_track *t, uint32_t at, uint32_t angle_q32)
{
    if (t->looks == 0u) {
        emf_track_begin(t, at, angle_q32, 0);
    } else if (t->looks == 1u) {
        const int32_t turned_q32 = (int32_t)(angle_q32 - t->angle_q32);
        emf_track_begin(t, at, angle_q32, turned_q32 / q15_max((int32_t)(at - t->at), 1));
        t->looks = 2u;
    } else {
        emf_track_add(t, at, angle_q32);
    }
}

/* ---- the search ---- */

#define ENOUGH_Q8   7 /* of i_max, in 256ths: current of a pulse that is long enough; up to twice as much is allowed */
#define SEEN_Q15    128 /* 8 codes of 12 bits: less is noise */
#define QUIET_LOOKS 3u
#define PAIR_SHIFT  3   /* an eighth of a millisecond between two pulses, and their own time */
#define GOOD_PULSES 10u /* in a row within the expected angle */
#define GOOD_STEPS  8u
#define PULSES_MS   40u
#define ZERO_MS     32u
#define SETTLES_MS  3u                       /* settling time of the current controllers */
#define MIN_STEPS   (CONFIG_BUS_STEPS / 128) /* an EMF of 0.8 % of the bus, if its rotation fits that size */
#define SURE_STEPS  (CONFIG_BUS_STEPS / 32)  /* 3 %: more than dead time can cause */
#define MEAN_SHIFT  3u                       /* 8 samples */
#define PLAYED      3u                       /* samples from setting the integrals to the PWM output */

#define HALF_TURN_Q32    0x80000000u
#define QUARTER_TURN_Q32 0x40000000u

void flying_begin(struct axis *a)
{
    a->flying = (struct flying){.counts = EMF_PULSE_MIN};
    current_loop_field(&a->loop, 0, 0);
    if (!current_loop_select(&a->loop, a->fabric, LOOP_OBSERVER)) {
        fault_raise(a, FAULT_FABRIC); /* the gate does not let go */
    }
}

/* ---- caught ---- */

/* Sets the loop's angle to the tracked one at the next sample. */
static void place(struct axis *a)
{
    volatile struct current_loop *const c = &a->loop;
    const struct emf_track *const t = &a->flying.track;
    const uint32_t mask = cpu_irq_save();
    current_loop_run(c, t->speed_q32);
    observer_reset(c, &a->tuning, emf_track_rotor_q32(t, adc_sequence(&a->fabric->adc) + 1u), 0);
    cpu_irq_restore(mask);
}

static void flying_lead(struct axis *a)
{
    a->sensorless = (struct sensorless){.step = 0};
    rotor_take_speed(a);
    a->sensorless.ref_rpm_q16 = a->speed.estimate.speed_rpm_q15 * 2;
}

/* With the bridge off: the PWM outputs the EMF before the gates switch on, right after a sample, where the ripple is zero. */
static void open_gates_to_emf(struct axis *a)
{
    place(a);
    current_loop_arm(&a->loop, a->fabric, &a->tuning);
    observer_follow(&a->loop, &a->tuning, OBSERVER_LEADS);
    emf_pulse_wait(a->fabric, PLAYED);
    place(a);
    (void)bridge_enable(&a->loop, a->fabric); /* if refused, the next step finds the fault */
    flying_lead(a);
}

/* With the bridge on and zero current, between two samples. The voltages do not change. */
static void turn_to_rotor(struct axis *a)
{
    volatile struct current_loop *const c = &a->loop;
    const uint32_t mask = cpu_irq_save();
    place(a);
    current_loop_follow_rotor(c);
    current_loop_restart_feedforward(c, a->fabric, &a->tuning);
    cpu_irq_restore(mask);
    flying_lead(a);
}

/* ---- pulses ---- */

static uint32_t emf_q32(const struct emf_pulse *p)
{
    return atan2_q32(p->i.beta, p->i.alpha) + HALF_TURN_Q32;
}

static void look_at_pulses(struct flying *f, const struct emf_pulse *first, const struct emf_pulse *second)
{
    const int32_t turned_q32 = (int32_t)(emf_q32(second) - emf_q32(first));
    if (f->track.looks == 0u) {
        emf_track_begin(&f->track, second->sequence, emf_q32(second),
                        turned_q32 / q15_max((int32_t)(second->sequence - first->sequence), 1));
    } else {
        emf_track_add(&f->track, second->sequence, emf_q32(second));
    }
}

/* The current gives the EMF's direction in the middle of the pulse. */
static void correct_for_length(struct axis *a)
{
    struct flying *const f = &a->flying;
    const int32_t late_q32 = (int32_t)((int64_t)f->track.speed_q32 * (int32_t)f->counts / (2 * a->tuning.loop_counts));
    f->track.angle_q32 += (uint32_t)late_q32;
}

static void regulate_to_zero(struct axis *a)
{
    struct flying *const f = &a->flying;
    f->regulates = true;
    f->ms = 0;
    f->track = (struct emf_track){.looks = 0};
    current_loop_on(&a->loop, a->fabric, &a->tuning);
}

static struct emf_pulse pulse(struct axis *a)
{
    const uint32_t counts = a->flying.counts;
    return counts < CONFIG_PWM_COUNTS ? emf_pulse(&a->loop, a->fabric, counts)
                                      : emf_pulse_period(&a->loop, a->fabric, (uint32_t)a->tuning.samples);
}

/* Doubles the pulse; finally a whole period, if its predicted current is allowed. */
static bool lengthen(struct axis *a, int32_t size_q15, int32_t enough_q15)
{
    struct flying *const f = &a->flying;
    const uint32_t longest = emf_pulse_longest(&a->fabric->pwm);
    const int32_t whole_q15 = size_q15 * (int32_t)(CONFIG_PWM_COUNTS / longest);
    if (size_q15 >= enough_q15 || f->counts == CONFIG_PWM_COUNTS ||
        (f->counts == longest && size_q15 >= SEEN_Q15 && whole_q15 > enough_q15)) {
        return false;
    }
    f->counts = f->counts == longest ? CONFIG_PWM_COUNTS : 2u * f->counts < longest ? 2u * f->counts : longest;
    f->track = (struct emf_track){.looks = 0};
    return true;
}

static int32_t size_of(const struct emf_pulse *p)
{
    return magnitude_q15(p->i.alpha, p->i.beta);
}

/* If whole periods give too noisy pulses, changes to measuring the voltage at zero current. */
static void give_up_pulses(struct axis *a)
{
    if (a->flying.counts == CONFIG_PWM_COUNTS) {
        regulate_to_zero(a);
    } else { /* uneven rotation, or wrong parameters */
        fault_raise(a, FAULT_LOCK_LOST);
    }
}

static enum flying_result step_pulses(struct axis *a)
{
    struct flying *const f = &a->flying;
    const struct emf_pulse first = pulse(a);
    emf_pulse_wait(a->fabric, (uint32_t)a->tuning.loops_per_slow >> PAIR_SHIFT);
    const struct emf_pulse second = pulse(a);
    const int32_t size_q15 = q15_min(size_of(&first), size_of(&second));
    if (lengthen(a, size_q15, q15_max((a->tuning.i_max_q15 * ENOUGH_Q8) >> 8, SEEN_Q15))) {
        return FLYING_SEARCHES;
    }
    f->quiet = size_q15 < SEEN_Q15 ? f->quiet + 1u : 0u;
    if (f->quiet >= QUIET_LOOKS) {
        regulate_to_zero(a);
        return FLYING_SEARCHES;
    }
    look_at_pulses(f, &first, &second);
    if (f->track.good >= GOOD_PULSES) {
        correct_for_length(a);
        open_gates_to_emf(a);
        return FLYING_CAUGHT;
    }
    if (f->ms > PULSES_MS) {
        give_up_pulses(a);
    }
    return FLYING_SEARCHES;
}

/* ---- no current ---- */

/* Mean of the voltages over some samples, against current-sensor noise; valid at the middle sample. */
static uint32_t mean_voltage(const struct axis *a, dq_t *v_steps)
{
    const volatile struct current_loop *const c = &a->loop;
    *v_steps = (dq_t){0, 0};
    for (uint32_t n = 0; n < 1u << MEAN_SHIFT; n++) {
        emf_pulse_wait(a->fabric, 1u);
        v_steps->d += c->v_d_steps;
        v_steps->q += c->v_q_steps;
    }
    v_steps->d >>= MEAN_SHIFT;
    v_steps->q >>= MEAN_SHIFT;
    return adc_sequence(&a->fabric->adc) - (1u << (MEAN_SHIFT - 1u));
}

/* An EMF, unlike dead-time error, rotates at the speed that its amplitude implies, within a factor of two. */
static bool speed_matches_amplitude(const struct axis *a, int32_t size_steps)
{
    const int32_t vbus_q15 = q15_max(adc_vbus_q15(&a->fabric->adc), 1);
    const int32_t w_q15 = q15_sat16(q15_abs(a->flying.track.speed_q32) >> a->loop.w_shift);
    const int32_t emf_steps = ((w_q15 * a->tuning.emf_q12) >> 12) * (CONFIG_BUS_STEPS / 2) / vbus_q15 * 2;
    return emf_steps > size_steps / 2 && emf_steps < size_steps * 2;
}

static enum flying_result step_zero(struct axis *a)
{
    struct flying *const f = &a->flying;
    dq_t v_steps;
    const uint32_t at = mean_voltage(a, &v_steps);
    const int32_t size_steps = magnitude_q15(v_steps.d, v_steps.q);
    if (f->ms > SETTLES_MS && size_steps > MIN_STEPS) {
        emf_track_add_any(&f->track, at, atan2_q32(v_steps.q, v_steps.d));
    } else {
        f->track = (struct emf_track){.looks = 0};
    }
    if (f->track.good >= GOOD_STEPS && (size_steps > SURE_STEPS || speed_matches_amplitude(a, size_steps))) {
        turn_to_rotor(a);
        return FLYING_CAUGHT;
    }
    return f->ms > ZERO_MS ? FLYING_STANDS : FLYING_SEARCHES;
}

enum flying_result flying_step(struct axis *a)
{
    a->flying.ms++;
    return a->flying.regulates ? step_zero(a) : step_pulses(a);
}

void flying_resume(struct axis *a, uint32_t angle_q32, int32_t speed_q32)
{
    const uint32_t emf_q32 = angle_q32 + (speed_q32 < 0 ? 3u * QUARTER_TURN_Q32 : QUARTER_TURN_Q32);
    emf_track_begin(&a->flying.track, adc_sequence(&a->fabric->adc) + 1u, emf_q32, speed_q32);
    open_gates_to_emf(a);
}

/* SPDX-License-Identifier: MIT */
/* The slow loop's part of the current loop: prepares the interrupt's inputs. */
#include "firmware/control/current_loop.h"

#include <stddef.h>

#include "drivers/cortex/cpu.h"
#include "drivers/fabric/fabric.h"
#include "firmware/control/bridge.h"
#include "firmware/settings/config.h"
#include "lib/advance.h"
#include "lib/deadtime.h"
#include "lib/limit.h"
#include "lib/pi.h"
#include "lib/q15.h"
#include "lib/trig.h"

/* The layout differs on machines with wider pointers: unit tests run on one, without assembly. */
#if UINTPTR_MAX == UINT32_MAX
#define AT(offset, member) \
    _Static_assert(offsetof(struct current_loop, member) == (offset), #member " is not where the assembly has it")
AT(LOOP_ANGLE, pll.angle_q32);
AT(LOOP_SPEED, pll.speed_q32);
AT(LOOP_ANGLE_OFFSET, angle_offset_q32);
AT(LOOP_SINE, sine);
AT(LOOP_I_D_REF, i_d_ref_q15);
AT(LOOP_I_Q_REF, i_q_ref_q15);
AT(LOOP_KP_D, kp_d_q9);
AT(LOOP_KP_Q, kp_q_q9);
AT(LOOP_INTEGRAL_D, integral_d_q9);
AT(LOOP_INTEGRAL_Q, integral_q_q9);
AT(LOOP_TURN, turn_q15);
AT(LOOP_KI, ki_q15);
AT(LOOP_I_D, i_d_q15);
AT(LOOP_I_Q, i_q_q15);
AT(LOOP_V_D, v_d_steps);
AT(LOOP_V_Q, v_q_steps);
AT(LOOP_ENCODER_SCALE, encoder_scale_q32);
AT(LOOP_STATUS_MAX, status_max);
AT(LOOP_CIRCLE, circle_steps);
#endif
_Static_assert(CONFIG_DEAD_COUNTS > 0 && CONFIG_DEAD_COUNTS < 256,
               "dead time: 10 to 2550 ns, the assembly's immediates");
_Static_assert(CONFIG_MIN_PULSE_COUNTS > 0 && CONFIG_MIN_PULSE_COUNTS < 256,
               "shortest pulse: 10 to 2550 ns, the PWM's register");
_Static_assert(CONFIG_RADIUS_STEPS <= PI_OUTPUT_MAX,
               "PWM period too long for the voltage's steps: lower CONFIG_V_SHIFT");
_Static_assert(CONFIG_RADIUS_STEPS > LOOP_V_D_MAX_STEPS,
               "dead time too long for the PWM period, or the period too short: v_d alone could leave the circle");

/* Per-unit voltages become steps by CONFIG_BUS_STEPS over the bus voltage. */
_Static_assert(CONFIG_BUS_STEPS % 8 == 0, "the gains take an eighth of it");
_Static_assert(CONFIG_BUS_STEPS < 1 << 17, "a voltage of the whole bus, with 14 more bits, fits a word");

/* A radian in Q15 as a fraction of a turn, Q32: 2^17 / 2 pi. */
#define TURN_Q32_PER_Q15 20861

/* Beyond 32 knees, half of the range, nothing is left to compensate. */
#define DEAD_SHIFT_MAX 5

/* Half a period at a speed of 1.0 = 1/16 turn a period, in radians. */
#define TURN_PER_HALF_Q15 6434

static void fill_circle(struct current_loop *c)
{
    for (int32_t n = 0; n < 1 << LOOP_CIRCLE_BITS; n++) {
        const int32_t low = (n - LOOP_CIRCLE_ZERO) * (1 << LOOP_CIRCLE_SHIFT);
        const int32_t farthest = low < 0 ? -low : low + (1 << LOOP_CIRCLE_SHIFT) - 1;
        c->circle_steps[n] = (uint16_t)circle_rest_q15(farthest, CONFIG_RADIUS_STEPS);
    }
}

void current_loop_init(struct current_loop *c)
{
    *c = (struct current_loop){.sine = trig_chords,
                               .status_max = UINT32_MAX,
                               .loops_per_slow = CONFIG_PERIODS_PER_SLOW,
                               .w_shift = CONFIG_W_SHIFT,
                               .weaken = {.radius_steps = CONFIG_RADIUS_STEPS, .gain_share_q8 = 256}};
    fill_circle(c);
}

void current_loop_tune(volatile struct current_loop *c, const struct tuning *t)
{
    c->encoder_scale_q32 = t->encoder_scale_q32;
    c->loops_per_slow = t->loops_per_slow;
    c->w_shift = CONFIG_W_SHIFT + 1u - (uint32_t)t->samples;
    c->ripple_q10 = t->ripple_q10;
    c->turn_per_w_q15 = t->delay_halves * TURN_PER_HALF_Q15 / t->samples;
    c->weaken = (struct loop_weakening){
        .on = t->weakens, .radius_steps = t->radius_steps, .gain_share_q8 = 256, .first_max_steps = LOOP_V_D_MAX_STEPS};
    c->fell_back = 0u;
    c->dead_shift = 0u;
}

/* ---- once a millisecond ---- */

/*
 * A per-unit voltage in loop steps, by the reciprocal of the bus voltage: one division serves both axes, and its 17 bits
 * resolve a step. It is clamped to the bus voltage, CONFIG_BUS_STEPS, so the product stays below 2^31.
 */
static int32_t steps_per_v_q14(int32_t vbus_q15)
{
    return (int32_t)(((uint32_t)CONFIG_BUS_STEPS << 14) / (uint32_t)vbus_q15);
}

static int32_t steps_of_v(int32_t v_q15, int32_t vbus_q15, int32_t per_v_q14)
{
    return (q15_clamp(v_q15, -vbus_q15, vbus_q15) * per_v_q14) >> 14;
}

/* The inverse: one step's voltage. Steps up to six-step, 0.64 of the bus, times this stay below 2^31. */
static int32_t v_per_step_q31(int32_t vbus_q15)
{
    return (int32_t)(((uint32_t)vbus_q15 * (0x80000000u / CONFIG_BUS_STEPS)) >> 15);
}

static int32_t v_of_steps(int32_t v_steps, int32_t per_step_q31)
{
    return (v_steps * per_step_q31) >> 16;
}

/* Publishes values for status, trace and the monitors. */
static int32_t publish(volatile struct current_loop *c, const struct fabric *f)
{
    const int32_t vbus_q15 = adc_vbus_q15(&f->adc);
    const int32_t per_step_q31 = v_per_step_q31(vbus_q15);
    const int32_t v_d_steps = c->v_d_steps; /* all reads first: a read after a write waits for it */
    const int32_t v_q_steps = c->v_q_steps;
    const int32_t radius_steps = c->weaken.radius_steps;
    c->vbus_q15 = vbus_q15;
    c->radius_q15 = v_of_steps(radius_steps, per_step_q31);
    c->v_d_q15 = v_of_steps(v_d_steps, per_step_q31);
    c->v_q_q15 = v_of_steps(v_q_steps, per_step_q31);
    if (pwm_fell_back(&f->pwm)) {
        c->fell_back++;
    }
    return vbus_q15;
}

/* The gains match the bus voltage within 1/128: recalculation takes three divisions. */
static bool gains_hold(const volatile struct current_loop *c, const struct tuning *t, int32_t vbus_q15)
{
    const int32_t off_q15 = q15_abs(vbus_q15 - c->gains_vbus_q15);
    return off_q15 * 128 <= vbus_q15 && c->gains_of == t;
}

/* The feed-forward is part of the integral (lib/pi.h): its change is added there. */
static void feed_forward(volatile int32_t *integral_q9, volatile int32_t *present_steps, int32_t wanted_steps)
{
    const int32_t change_steps = wanted_steps - *present_steps;
    if (change_steps != 0) {
        cpu_add(integral_q9, change_steps * (1 << PI_SHIFT));
        *present_steps = wanted_steps;
    }
}

/* Decoupling of the axes, and the EMF: v_d = ... - w Lq i_q, v_q = ... + w (Ld i_d + psi). */
static void decouple(volatile struct current_loop *c, const struct tuning *t, int32_t w_q15, int32_t vbus_q15)
{
    const int32_t per_v_q14 = steps_per_v_q14(vbus_q15);
    const int32_t d_q15 = -tuning_reactive_q15(w_q15, c->i_q_ref_q15, t->x_q_q11);
    const int32_t q_q15 = tuning_reactive_q15(w_q15, c->i_d_ref_q15, t->x_d_q11) + ((w_q15 * t->emf_q12) >> 12);
    feed_forward(&c->integral_d_q9, &c->feedforward_d_steps, steps_of_v(d_q15, vbus_q15, per_v_q14));
    feed_forward(&c->integral_q_q9, &c->feedforward_q_steps, steps_of_v(q_q15, vbus_q15, per_v_q14));
}

/* Whether the currents' frame is the rotor's, not a prescribed field's. */
static bool follows_rotor(const volatile struct current_loop *c)
{
    return c->source == LOOP_ENCODER || (current_loop_finds_rotor(c) && c->field_follows != 0u);
}

static int32_t frame_w_q15(const volatile struct current_loop *c)
{
    return follows_rotor(c) ? current_loop_w_q15(c) : q15_sat16(c->field_speed_q32 >> c->w_shift);
}

/* Field weakening needs the encoder. */
static bool weakens(const volatile struct current_loop *c)
{
    return c->weaken.on && c->source == LOOP_ENCODER;
}

/*
 * The knee of the dead-time compensation is as wide as the ripple: below it the sampled current's sign may differ from that
 * when the leg switches, and compensation would act as negative resistance.
 */
static void follow_ripple(volatile struct current_loop *c)
{
    const int32_t d_q15 = q15_abs(c->v_d_q15);
    const int32_t q_q15 = q15_abs(c->v_q_q15);
    const int32_t v_q15 = q15_max(d_q15, q_q15) + q15_min(d_q15, q_q15) / 2;
    const uint32_t knees = (uint32_t)(v_q15 / 2 * c->ripple_q10) / (512u * DEADTIME_KNEE_Q15);
    c->dead_shift = knees == 0u ? 0u : (uint32_t)q15_min(32 - __builtin_clz(knees), DEAD_SHIFT_MAX);
}

/* kp + ki: see lib/pi.h. */
static void loop_set_gains(volatile struct current_loop *c, const struct tuning *t, int32_t vbus_q15)
{
    const int32_t ki_q15 = q15_min(t->ki_q17 * (CONFIG_BUS_STEPS / 4) / vbus_q15, PI_KI_MAX_Q15);
    c->kp_d_q9 = q15_min(t->kp_d_q12 * (CONFIG_BUS_STEPS / 8) / vbus_q15 + (ki_q15 >> 6), PI_KP_MAX_Q9);
    c->kp_q_rated_q9 = q15_min(t->kp_q_q12 * (CONFIG_BUS_STEPS / 8) / vbus_q15, PI_KP_MAX_Q9);
    c->kp_q_q9 = q15_min(c->kp_q_rated_q9 + (ki_q15 >> 6), PI_KP_MAX_Q9);
    c->ki_q15 = ki_q15;
    c->gains_vbus_q15 = vbus_q15;
    c->gains_of = t;
}

/*
 * For saturating iron, q's gain uses the inductance at the present current: the gain for rated current would leave an eighth of
 * the bandwidth at no load. The larger of reference and measurement is used, because too small a gain is slow but too large a
 * one unstable: while the current decreases, the gain follows it. Only in the rotor's frame.
 */
static void follow_iron(volatile struct current_loop *c, const struct tuning *t)
{
    const int32_t i_q15 = q15_min(q15_max(q15_abs(c->i_q_ref_q15), q15_abs(c->i_q_q15)), Q15_ONE);
    const uint32_t square_q15 = (uint32_t)(i_q15 * i_q15) >> 15;
    const uint32_t stiffness_q15 = (uint32_t)t->iron_rest_q15 + ((square_q15 * (uint32_t)t->iron_grows_q10) >> 10);
    const uint32_t kp_q9 = ((uint32_t)c->kp_q_rated_q9 << 15) / stiffness_q15 + ((uint32_t)c->ki_q15 >> 6);
    c->kp_q_q9 = q15_min((int32_t)kp_q9, PI_KP_MAX_Q9);
}

static void clear_gains(volatile struct current_loop *c)
{
    c->kp_d_q9 = 0;
    c->kp_q_q9 = 0;
    c->ki_q15 = 0;
    c->integral_d_q9 = 0;
    c->integral_q_q9 = 0;
    c->weaken.retreat_q22 = 0;
    c->feedforward_d_steps = 0;
    c->feedforward_q_steps = 0;
    c->gains_of = NULL;
}

void current_loop_follow(volatile struct current_loop *c, const struct fabric *f, const struct tuning *t)
{
    const int32_t w_q15 = frame_w_q15(c);
    const int32_t bus_q15 = publish(c, f);
    if (c->ripple_q10 != 0) {
        follow_ripple(c);
    }
    const int32_t turn_until_q15 = (w_q15 * c->turn_per_w_q15) >> 15;
    const int32_t turn_q15 = q15_clamp(turn_until_q15, -LOOP_TURN_MAX_Q15, LOOP_TURN_MAX_Q15);
    c->turn_q15 = turn_q15;
    c->v_turn_q15 = turn_q15;
    if (weakens(c)) {
        c->weaken.turn_q32 = (uint32_t)(turn_until_q15 * TURN_Q32_PER_Q15);
        c->v_turn_q15 = 0;
    }
    if (c->status_max == UINT32_MAX) {
        clear_gains(c);
        return;
    }
    const int32_t vbus_q15 = q15_max(bus_q15, t->v_min_q15);
    if (!gains_hold(c, t, vbus_q15)) {
        loop_set_gains(c, t, vbus_q15);
    }
    if (t->iron_grows_q10 != 0 && follows_rotor(c)) {
        follow_iron(c, t);
    }
    decouple(c, t, w_q15, vbus_q15);
}

/*
 * The order matters, and tests/tools/test_order.py checks it in the object code. Stale state must not trip: overrun and limits
 * are set before the gates are enabled. The integrals are cleared before anything reaches the motor. Faults are checked only
 * with enabled gates, because the status differs before.
 */
void current_loop_on(volatile struct current_loop *c, struct fabric *f, const struct tuning *t)
{
    adc_clear_overrun(&f->adc);
    adc_set_limits(&f->adc, t->i_trip_q15, t->i_sum_q15, t->v_min_q15, t->v_max_q15);
    c->i_d_ref_q15 = 0;
    c->i_q_ref_q15 = 0;
    clear_gains(c);
    if (!bridge_enable(c, f)) {
        return;
    }
    c->status_max = GATE_STATUS_LIVE;
    current_loop_follow(c, f, t);
}

void current_loop_arm(volatile struct current_loop *c, struct fabric *f, const struct tuning *t)
{
    adc_clear_overrun(&f->adc);
    adc_set_limits(&f->adc, t->i_trip_q15, t->i_sum_q15, t->v_min_q15, t->v_max_q15);
    c->i_d_ref_q15 = 0;
    c->i_q_ref_q15 = 0;
    c->field_angle_q32 = 0u;
    c->field_speed_q32 = 0;
    c->field_follows = UINT32_MAX;
    clear_gains(c);
    c->status_max = GATE_STATUS_LIVE;
    current_loop_follow(c, f, t);
}

/* Gates off first, always. */
void current_loop_off(volatile struct current_loop *c, struct fabric *f)
{
    gate_disable(&f->gate);
    c->status_max = UINT32_MAX;
    c->i_d_ref_q15 = 0;
    c->i_q_ref_q15 = 0;
    clear_gains(c);
}

static void (*handler(const volatile struct current_loop *c, enum loop_source source))(void)
{
    if (weakens(c)) {
        const bool beyond = c->weaken.radius_steps > CONFIG_RADIUS_STEPS;
        return beyond ? c->handlers->overmodulating : c->handlers->weakening;
    }
    const bool rippled = c->ripple_q10 != 0 && source == LOOP_ENCODER;
    return rippled ? c->handlers->rippled : c->handlers->handler[source];
}

static void set_vector(const volatile struct current_loop *c, void (*chosen)(void))
{
    *(c->diverted != NULL ? c->diverted : c->handlers->vector) = chosen;
}

bool current_loop_select(volatile struct current_loop *c, const struct fabric *f, enum loop_source source)
{
    if ((gate_status(&f->gate) & GATE_STATUS_LIVE) != 0u) {
        return false;
    }
    c->source = source;
    c->field_follows = 0u;
    if (c->handlers != NULL) {
        set_vector(c, handler(c, source));
        cpu_dsb(); /* visible to the next interrupt */
    }
    return true;
}

void current_loop_exchange(volatile struct current_loop *c, enum loop_source source)
{
    c->source = source;
    if (c->handlers != NULL) {
        set_vector(c, handler(c, source));
    }
}

void current_loop_field(volatile struct current_loop *c, uint32_t angle_q32, int32_t speed_q32)
{
    c->field_speed_q32 = speed_q32;
    c->field_angle_q32 = angle_q32;
}

void current_loop_restart_feedforward(volatile struct current_loop *c, const struct fabric *f, const struct tuning *t)
{
    const uint32_t mask = cpu_irq_save();
    const int32_t d_q9 = c->integral_d_q9;
    const int32_t q_q9 = c->integral_q_q9;
    current_loop_follow(c, f, t);
    c->integral_d_q9 = d_q9;
    c->integral_q_q9 = q_q9;
    cpu_irq_restore(mask);
}

/* ==== another entry before the handler ==== */

void current_loop_divert(volatile struct current_loop *c, void (*entry)(void), void (**handler)(void))
{
    const uint32_t mask = cpu_irq_save(); /* the slow loop may select another one */
    if (c->diverted == NULL) {
        *handler = *c->handlers->vector;
        c->diverted = handler;
        *c->handlers->vector = entry;
    }
    cpu_irq_restore(mask);
}

void current_loop_undivert(volatile struct current_loop *c)
{
    const uint32_t mask = cpu_irq_save();
    if (c->diverted != NULL) {
        *c->handlers->vector = *c->diverted;
        c->diverted = NULL;
        cpu_dsb(); /* visible to the next interrupt */
    }
    cpu_irq_restore(mask);
}

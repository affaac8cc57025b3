/* SPDX-License-Identifier: MIT */
/* The current loop's other half: what the slow loop prepares for the interrupt, and what a sample with a fault leads to. */
#include "firmware/current_loop.h"

#include <stddef.h>

#include "drivers/cortex/cpu.h"
#include "drivers/cortex/dwt.h"
#include "drivers/cortex/nvic.h"
#include "drivers/fabric/adc.h"
#include "drivers/fabric/corepwm.h"
#include "drivers/fabric/encoder.h"
#include "drivers/fabric/gate.h"
#include "firmware/config.h"
#include "firmware/drive.h"
#include "firmware/fault.h"
#include "lib/advance.h"
#include "lib/limit.h"
#include "lib/pi.h"
#include "lib/trig.h"
#include "startup/startup.h"

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
AT(LOOP_V_D, v_d_q4);
AT(LOOP_V_Q, v_q_q4);
AT(LOOP_ENCODER, encoder_scale_q32);
AT(LOOP_STATUS_MAX, status_max);
AT(LOOP_CIRCLE, circle_q4);
_Static_assert(LOOP_PWM_COUNTS == CONFIG_PWM_COUNTS, "set LOOP_PWM_COUNTS in current_loop_layout.h as well");
_Static_assert(LOOP_DEAD_COUNTS == CONFIG_DEAD_COUNTS, "set LOOP_DEAD_COUNTS in current_loop_layout.h as well");
_Static_assert(LOOP_V_D_MAX_Q4 == 1 << 14, "SSAT #15 in the assembly");
_Static_assert(LOOP_DEAD_COUNTS < 256 && LOOP_PWM_COUNTS % 4 == 0, "the assembly's immediates");

/*
 * Radius of the circle, v_q4: a phase reaches Vbus/sqrt(3) with space vectors, and of each half of the period two dead times
 * are lost, because the edges of both sides and their dead times must fit into the period. Some counts are kept for rounding.
 */
#define RADIUS_COUNTS (CONFIG_PWM_COUNTS - 4u * CONFIG_DEAD_COUNTS - 8u)
#define RADIUS_Q4     ((int32_t)(RADIUS_COUNTS * 8u * 18919u / 32768u)) /* half of it, 16 to a count, over sqrt(3) */

/* What v_q4 can express: PWM periods of about 3900 to 7100 counts, 14 to 25 kHz at 100 MHz. */
_Static_assert(RADIUS_Q4 <= PI_OUTPUT_MAX, "PWM period too long for 16 steps a count: fewer, here and in the assembly");
_Static_assert(RADIUS_Q4 > LOOP_V_D_MAX_Q4,
               "PWM period too short: v_d alone could leave the circle; a smaller SSAT in the assembly");

/* Volts of the per-unit system become v_q4 by this over the bus voltage: v / vbus of half a period, 16 to a count. */
#define V_FULL_Q4 ((int32_t)CONFIG_PWM_COUNTS * 8)

/* 1.5 periods at a speed of 1.0 = 1/16 turn a period, in radians */
#define TURN_PER_W_Q15 19302

/*
 * The largest turn, at 770 Hz electrical; beyond it the voltages lag. Larger ones could turn a saturated voltage back inside
 * the circle, where the integral would not see that it is limited.
 */
#define TURN_MAX_Q15 11900

struct current_loop current_loop = {
    .sine = trig_chords,
    .status_max = UINT32_MAX,
};

static void fill_circle(struct current_loop *c)
{
    for (int32_t n = 0; n < 512; n++) {
        const int32_t low = (n - LOOP_CIRCLE_ZERO) * (1 << LOOP_CIRCLE_SHIFT);
        const int32_t farthest = low < 0 ? -low : low + (1 << LOOP_CIRCLE_SHIFT) - 1;
        c->circle_q4[n] = (uint16_t)circle_rest_q15(farthest, RADIUS_Q4);
    }
}

void current_loop_tune(const struct tuning *t)
{
    current_loop.encoder_scale_q32 = t->encoder_scale_q32;
}

bool current_loop_start(uint32_t encoder_counts)
{
    encoder_init(encoder_counts, false);
    const bool running = corepwm_init(CONFIG_PWM_COUNTS);
    fill_circle(&current_loop);
    nvic_priority(BOARD_IRQ_ADC, CONFIG_PRIORITY_CURRENT_LOOP);
    nvic_enable(BOARD_IRQ_ADC);
    adc_start();
    return running;
}

/* ---- once a millisecond ---- */

/* A voltage of the per-unit system in the loop's unit. */
static int32_t v_q4(int32_t v_q15, int32_t vbus_q15)
{
    return q15_clamp(v_q15, -Q15_ONE, Q15_ONE) * V_FULL_Q4 / vbus_q15;
}

static int32_t v_q15(int32_t v_q4, int32_t vbus_q15)
{
    return v_q4 * vbus_q15 / V_FULL_Q4;
}

/* What it shows to others. */
static void publish(struct current_loop *c)
{
    c->vbus_q15 = adc_vbus_q15();
    c->radius_q15 = v_q15(RADIUS_Q4, c->vbus_q15);
    c->v_d_q15 = v_q15(c->v_d_q4, c->vbus_q15);
    c->v_q_q15 = v_q15(c->v_q_q4, c->vbus_q15);
}

/* The gains hold for the bus as it is. kp + ki: see lib/pi.h. */
static void set_gains(struct current_loop *c, const struct tuning *t, int32_t vbus_q15)
{
    const int32_t ki_q15 = q15_min(t->ki_q17 * (V_FULL_Q4 / 4) / vbus_q15, PI_KI_MAX_Q15);
    c->kp_d_q9 = q15_min(t->kp_d_q12 * (V_FULL_Q4 / 8) / vbus_q15 + (ki_q15 >> 6), PI_KP_MAX_Q9);
    c->kp_q_q9 = q15_min(t->kp_q_q12 * (V_FULL_Q4 / 8) / vbus_q15 + (ki_q15 >> 6), PI_KP_MAX_Q9);
    c->ki_q15 = ki_q15;
}

/* The feed-forward is part of the integral (lib/pi.h): what it has changed by is added there. */
static void feed_forward(volatile int32_t *integral_q9, int32_t *present_q4, int32_t wanted_q4)
{
    cpu_add(integral_q9, (wanted_q4 - *present_q4) * 512);
    *present_q4 = wanted_q4;
}

/* The axes disturb each other and the magnets disturb q: v_d = ... - w Lq i_q, v_q = ... + w (Ld i_d + psi). */
static void decouple(struct current_loop *c, const struct tuning *t, int32_t w_q15, int32_t vbus_q15)
{
    const int32_t d_q15 = -(((w_q15 * c->i_q_ref_q15) >> 15) * t->x_q_q11 >> 11);
    const int32_t q_q15 = (((w_q15 * c->i_d_ref_q15) >> 15) * t->x_d_q11 >> 11) + ((w_q15 * t->emf_q12) >> 12);
    feed_forward(&c->integral_d_q9, &c->feedforward_d_q4, v_q4(d_q15, vbus_q15));
    feed_forward(&c->integral_q_q9, &c->feedforward_q_q4, v_q4(q_q15, vbus_q15));
}

static void rest(struct current_loop *c)
{
    c->kp_d_q9 = 0;
    c->kp_q_q9 = 0;
    c->ki_q15 = 0;
    c->integral_d_q9 = 0;
    c->integral_q_q9 = 0;
    c->feedforward_d_q4 = 0;
    c->feedforward_q_q4 = 0;
}

void current_loop_follow(const struct tuning *t)
{
    struct current_loop *const c = &current_loop;
    const int32_t w_q15 = current_loop_w_q15();
    publish(c);
    c->turn_q15 = q15_clamp((w_q15 * TURN_PER_W_Q15) >> 15, -TURN_MAX_Q15, TURN_MAX_Q15);
    if (c->status_max == UINT32_MAX) {
        rest(c);
        return;
    }
    const int32_t vbus_q15 = q15_max(c->vbus_q15, t->v_min_q15);
    set_gains(c, t, vbus_q15);
    decouple(c, t, w_q15, vbus_q15);
}

void current_loop_on(const struct tuning *t)
{
    struct current_loop *const c = &current_loop;
    c->i_d_ref_q15 = 0;
    c->i_q_ref_q15 = 0;
    rest(c);
    adc_clear_overrun();
    adc_set_limits(t->i_trip_q15, t->i_sum_q15, t->v_min_q15, t->v_max_q15);
    gate_enable();
    c->status_max = GATE_STATUS_LIVE;
    current_loop_follow(t);
}

void current_loop_off(void)
{
    struct current_loop *const c = &current_loop;
    c->status_max = UINT32_MAX;
    gate_disable();
    c->i_d_ref_q15 = 0;
    c->i_q_ref_q15 = 0;
    rest(c);
}

/* Until the next call the field goes along with the rotor: so that it is right in the middle of the time. */
void current_loop_force_angle(uint32_t angle_q32)
{
    const uint32_t halfway_q32 = (uint32_t)current_loop.pll.speed_q32 * (CONFIG_LOOPS_PER_SLOW / 2u);
    current_loop.angle_offset_q32 = angle_q32 - current_loop.pll.angle_q32 - halfway_q32;
}

/* ---- a sample with a fault ---- */

/* First cause: hardware latches before what is concluded from a sample. Tail of the interrupt, so rare that it may branch. */
void current_loop_fault(void)
{
    const uint32_t gate = gate_status();
    const uint32_t adc = adc_status();
    if ((gate & GATE_STATUS_LATCHES) != 0u) {
        fault_raise(fault_from_gate(gate));
    } else if ((gate & GATE_STATUS_ENCODER) != 0u) {
        fault_raise(FAULT_ENCODER);
    } else if ((adc & ADC_STATUS_CURRENT) != 0u) {
        fault_raise(FAULT_OVERCURRENT);
    } else if ((adc & ADC_STATUS_SUM) != 0u) {
        fault_raise(FAULT_CURRENT_SUM);
    } else if ((adc & ADC_STATUS_VBUS_HIGH) != 0u) {
        fault_raise(FAULT_OVERVOLTAGE);
    } else if ((adc & ADC_STATUS_VBUS_LOW) != 0u) {
        fault_raise(FAULT_UNDERVOLTAGE);
    } else if ((gate & GATE_STATUS_OVERRUN) != 0u) {
        fault_raise(FAULT_LOOP_OVERRUN);
    }
}

/* ---- what it costs ---- */

/*
 * The longest gap between two looks at the counter is an interrupt; the shortest is what looking takes. The first gap is too
 * short for that: it has no turn of the loop in it. None is kept by a branch, which would lengthen the next.
 */
static uint32_t longest_gap(void)
{
    const uint32_t start = dwt_cycles();
    uint32_t before = start;
    int32_t longest = 0;
    int32_t shortest = INT32_MAX;
    int32_t first = 100;
    while (before - start < 2u * CONFIG_PWM_COUNTS) {
        const uint32_t now = dwt_cycles();
        const int32_t gap = (int32_t)(now - before) + first;
        longest = q15_max(longest, gap);
        shortest = q15_min(shortest, gap);
        first = 0;
        before = now;
    }
    return (uint32_t)(longest - shortest);
}

uint32_t current_loop_measure_cycles(void)
{
    uint32_t cycles = 0;
    for (unsigned attempt = 0; attempt < 4u; attempt++) {
        const uint32_t before_ms = drive.time_ms;
        cycles = longest_gap();
        if (drive.time_ms == before_ms) { /* or the slow loop was the longest */
            break;
        }
    }
    return cycles;
}

/* SPDX-License-Identifier: MIT */
/*
 * ADC -> Clarke -> Park -> PI -> inverse Park -> inverse Clarke -> space vector -> dead time -> PWM, then protection.
 *
 * The voltages computed from the sample at the start of period k take effect at the start of period k+1 and act, on
 * average, in its middle: 1.5 periods after the sample. The rotor has turned on by then, so the inverse Park uses the
 * angle of that moment.
 */
#include "firmware/current_loop.h"

#include "drivers/cortex/dwt.h"
#include "drivers/cortex/nvic.h"
#include "drivers/fabric/adc.h"
#include "drivers/fabric/corepwm.h"
#include "drivers/fabric/encoder.h"
#include "drivers/fabric/gate.h"
#include "firmware/config.h"
#include "firmware/fault.h"
#include "lib/deadtime.h"
#include "lib/limit.h"
#include "lib/modulation.h"
#include "lib/transform_q15.h"
#include "lib/trig.h"
#include "startup/startup.h"

/*
 * Usable part of the bus: a phase reaches Vbus/sqrt(3) with space vectors, and of each half of the period two dead times
 * are lost, because the edges of both sides and their dead times must fit into one period.
 */
#define RADIUS_PER_VBUS_Q15 ((int32_t)(18919u * (CONFIG_PWM_COUNTS - 4u * CONFIG_DEAD_COUNTS) / CONFIG_PWM_COUNTS))

/* Below 512 LSB of Q15 (1.6 % of i_range) the sign of a current is not certain: compensate in proportion. */
#define DEAD_TIME_KNEE_SHIFT 9u

/*
 * Angle and speed observer: 200 Hz, critically damped; 2 pi 200 / 20000 in Q16. A slower one lags and
 * costs the speed loop its damping, a faster one passes the encoder's steps on to the torque. It serves the angle, too: the
 * raw one has the encoder's steps, which turn part of i_q into i_d.
 */
#define OBSERVER_NATURAL_Q16 4118u

#define SUM_BAD_LIMIT 2u /* samples in a row: one may be a disturbance */

struct current_loop current_loop = {
    .encoder_mask = UINT32_MAX,
    .vbus_recip_q14 = RECIP_ONE_Q14,
};

void current_loop_tune(const struct tuning *t)
{
    struct current_loop *const c = &current_loop;
    c->pi_d.kp_q12 = t->kp_d_q12;
    c->pi_d.ki_q17 = t->ki_q17;
    c->pi_q.kp_q12 = t->kp_q_q12;
    c->pi_q.ki_q17 = t->ki_q17;
    c->x_d_q11 = t->x_d_q11;
    c->x_q_q11 = t->x_q_q11;
    c->emf_q12 = t->emf_q12;
    c->i_trip_q15 = t->i_trip_q15;
    c->i_sum_q15 = t->i_sum_q15;
    c->v_min_q15 = t->v_min_q15;
    c->v_max_q15 = t->v_max_q15;
    c->overspeed_w_q15 = t->overspeed_w_q15;
    c->encoder_scale_q32 = t->encoder_scale_q32;
}

bool current_loop_start(uint32_t encoder_counts)
{
    pll_set_bandwidth(&current_loop.pll, OBSERVER_NATURAL_Q16);
    encoder_init(encoder_counts, false);
    const bool running = corepwm_init(CONFIG_PWM_COUNTS);
    nvic_priority(BOARD_IRQ_ADC, CONFIG_PRIORITY_CURRENT_LOOP);
    nvic_enable(BOARD_IRQ_ADC);
    adc_start();
    return running;
}

void current_loop_prepare(void)
{
    struct current_loop *const c = &current_loop;
    c->i_d_ref_q15 = 0;
    c->i_q_ref_q15 = 0;
    c->sum_bad_samples = 0;
    c->vbus_recip_q14 = (RECIP_ONE_Q14 * Q15_ONE) / (c->vbus_q15 > c->v_min_q15 ? c->vbus_q15 : c->v_min_q15);
}

static inline uint32_t bit_if(bool condition, uint32_t bit)
{
    return condition ? bit : 0u;
}

/* More than twice the voltage range cannot be meant, and would not fit the controller. */
static inline int32_t feedforward(int32_t v_q15)
{
    return q15_clamp(v_q15, -2 * Q15_ONE, 2 * Q15_ONE);
}

static inline dq_t regulate(struct current_loop *c, dq_t i, int32_t w_q15)
{
    /* the axes disturb each other and the magnets disturb q: v_d = ... - w Lq i_q, v_q = ... + w (Ld i_d + psi) */
    const int32_t ff_d = -(((w_q15 * i.q) >> 15) * c->x_q_q11 >> 11);
    const int32_t ff_q = (((w_q15 * i.d) >> 15) * c->x_d_q11 >> 11) + ((w_q15 * c->emf_q12) >> 12);
    const int32_t radius = (c->vbus_q15 * RADIUS_PER_VBUS_Q15) >> 15;
    c->radius_q15 = radius;
    dq_t v;
    v.d = pi_q15_step(&c->pi_d, c->i_d_ref_q15 - i.d, feedforward(ff_d), radius);
    v.q = pi_q15_step(&c->pi_q, c->i_q_ref_q15 - i.q, feedforward(ff_q), circle_rest_q15(v.d, radius));
    c->pi_d.integral_q30 &= (int32_t)c->integrate_mask;
    c->pi_q.integral_q30 &= (int32_t)c->integrate_mask;
    return v;
}

/*
 * During its dead times a phase lies at the rail that its current chooses: with our edges, the on-time comes out as commanded
 * for a positive current and two dead times longer for a negative one. So command one dead time less, plus or minus one.
 */
static inline uint32_t on_counts(int32_t duty_q15, int32_t i_q15)
{
    const int32_t dead = (int32_t)CONFIG_DEAD_COUNTS;
    const int32_t even = ((duty_q15 * (int32_t)CONFIG_PWM_COUNTS) >> 15) - dead;
    return (uint32_t)(even + deadtime_comp(i_q15, dead, DEAD_TIME_KNEE_SHIFT)); /* the driver limits it */
}

static inline abc_t phases(dq_t x, cossin_t cs)
{
    return invclarke_q15(invpark_q15(x, cs));
}

/* `cs` is the angle at which the voltages will act: the currents will have turned with it, and so will their signs. */
static inline void modulate(const struct current_loop *c, dq_t v, dq_t i, cossin_t cs)
{
    const abc_t duty = svm_minmax_q15(phases(v, cs), c->vbus_recip_q14);
    const abc_t current = phases(i, cs);
    corepwm_write_legs(on_counts(duty.a, current.a), on_counts(duty.b, current.b), on_counts(duty.c, current.c),
                       CONFIG_DEAD_COUNTS, CONFIG_PWM_COUNTS);
}

/* The TRIP_ bits that this sample raises. */
static inline uint32_t trips(struct current_loop *c, int32_t w_q15, uint32_t encoder_flags)
{
    const abc_t i = c->i_q15;
    const bool sum_bad = q15_abs(i.a + i.b + i.c) > c->i_sum_q15;
    c->sum_bad_samples = sum_bad ? c->sum_bad_samples + 1u : 0u;
    const int32_t i_peak = q15_max(q15_abs(i.a), q15_max(q15_abs(i.b), q15_abs(i.c)));
    return bit_if((encoder_flags & (ENCODER_STATUS_ILLEGAL | ENCODER_STATUS_SIGNAL_LOST)) != 0u, TRIP_ENCODER) |
           bit_if(i_peak > c->i_trip_q15, TRIP_OVERCURRENT) |
           bit_if(c->sum_bad_samples >= SUM_BAD_LIMIT, TRIP_CURRENT_SUM) |
           bit_if(c->vbus_q15 > c->v_max_q15, TRIP_OVERVOLTAGE) |
           bit_if(c->vbus_q15 < c->v_min_q15, TRIP_UNDERVOLTAGE) |
           bit_if(q15_abs(w_q15) > c->overspeed_w_q15, TRIP_OVERSPEED);
}

/* First cause of a sample that trips: hardware latches before conclusions. Rare, so it may branch. */
static void __attribute__((noinline, cold)) trip(uint32_t raised, uint32_t gate_flags)
{
    static const enum fault by_bit[] = {FAULT_ENCODER,     FAULT_OVERCURRENT,  FAULT_CURRENT_SUM,
                                        FAULT_OVERVOLTAGE, FAULT_UNDERVOLTAGE, FAULT_OVERSPEED};
    if ((gate_flags & GATE_STATUS_LATCHES) != 0u) {
        fault_raise(fault_from_gate(gate_flags));
        return;
    }
    for (unsigned bit = 0; bit < sizeof by_bit / sizeof by_bit[0]; bit++) {
        if ((raised & (1u << bit)) != 0u) {
            fault_raise(by_bit[bit]);
            return;
        }
    }
}

void FabricIrq0_IRQHandler(void)
{
    struct current_loop *const c = &current_loop;
    const uint32_t start = dwt_cycles();

    const struct adc_sample sample = adc_read();
    const uint32_t position = encoder_latched();
    const uint32_t adc_flags = adc_take_status();

    c->i_q15.a = sample.ia_q15;
    c->i_q15.b = sample.ib_q15;
    c->i_q15.c = sample.ic_q15;
    c->vbus_q15 = sample.vbus_q15;
    c->vbus_recip_q14 = recip_q14_refine(c->vbus_recip_q14, q15_max(c->vbus_q15, c->v_min_q15));

    pll_step(&c->pll, position * c->encoder_scale_q32);
    const int32_t speed_q32 = c->pll.speed_q32;
    const int32_t w_q15 = current_loop_w_q15();

    const uint32_t angle_q32 = (c->pll.angle_q32 & c->encoder_mask) + c->angle_offset_q32;
    const dq_t i = park_q15(clarke_q15(c->i_q15.a, c->i_q15.b), cossin_q15(angle_q32));
    const dq_t v = regulate(c, i, w_q15);

    const uint32_t advance_q32 = ((uint32_t)speed_q32 + (uint32_t)(speed_q32 >> 1)) & c->encoder_mask;
    modulate(c, v, i, cossin_q15(angle_q32 + advance_q32));

    /* the PWM is written; the rest can wait */
    c->i_d_q15 = i.d;
    c->i_q_q15 = i.q;
    c->v_d_q15 = v.d;
    c->v_q_q15 = v.q;
    c->angle_u16 = angle_q32 >> 16;

    const uint32_t gate_flags = gate_status();
    const uint32_t raised = trips(c, w_q15, encoder_status()) & c->armed;
    if ((raised | (gate_flags & GATE_STATUS_LATCHES)) != 0u) {
        trip(raised, gate_flags);
    } else if ((adc_flags & ADC_STATUS_OVERRUN) != 0u && c->armed != 0u) {
        fault_raise(FAULT_LOOP_OVERRUN);
    }

    c->samples++;
    c->cycles = dwt_cycles() - start;
    c->cycles_max = c->cycles > c->cycles_max ? c->cycles : c->cycles_max;
}

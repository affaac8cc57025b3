/* SPDX-License-Identifier: MIT */
/*
 * CorePWM 4.3 in fabric slot 0: three half bridges and the ADC trigger. Registers: CorePWM handbook, register map;
 * use of the channels: docs/fabric.md, slot 0.
 *
 * What has to be known about this core, because it decides the order of things here:
 *  - it counts from reset on, with PRESCALE 8 and PERIOD 8;
 *  - PRESCALE, PERIOD and the enable bits take effect at the end of the running period, edges only if SYNC_UPDATE is 1
 *    at that moment; reading gives the value in effect, not the one written;
 *  - two equal edges of a channel toggle its output once a period, and an edge beyond PERIOD never comes;
 *  - it knows neither complementary outputs nor dead time, so a phase takes two channels.
 *
 * None of this switches the bridge off at once: that is gate_disable().
 */
#ifndef DRIVERS_FABRIC_COREPWM_H
#define DRIVERS_FABRIC_COREPWM_H

#include "drivers/board.h"
#include "drivers/reg.h"

struct corepwm_regs {
    volatile uint32_t PRESCALE;
    volatile uint32_t PERIOD;
    volatile uint32_t PWM_ENABLE_0_7;
    volatile uint32_t PWM_ENABLE_8_15;
    volatile uint32_t PWM1_POSEDGE;
    volatile uint32_t PWM1_NEGEDGE;
    volatile uint32_t PWM2_POSEDGE;
    volatile uint32_t PWM2_NEGEDGE;
    volatile uint32_t PWM3_POSEDGE;
    volatile uint32_t PWM3_NEGEDGE;
    volatile uint32_t PWM4_POSEDGE;
    volatile uint32_t PWM4_NEGEDGE;
    volatile uint32_t PWM5_POSEDGE;
    volatile uint32_t PWM5_NEGEDGE;
    volatile uint32_t PWM6_POSEDGE;
    volatile uint32_t PWM6_NEGEDGE;
    volatile uint32_t PWM7_POSEDGE;
    volatile uint32_t PWM7_NEGEDGE;
    uint32_t reserved_48[39]; /* channels 8...16 and the tachometer: not in this design */
    volatile uint32_t SYNC_UPDATE;
};

REG_AT_OFFSET(struct corepwm_regs, PRESCALE, 0x00);
REG_AT_OFFSET(struct corepwm_regs, PERIOD, 0x04);
REG_AT_OFFSET(struct corepwm_regs, PWM_ENABLE_0_7, 0x08);
REG_AT_OFFSET(struct corepwm_regs, PWM_ENABLE_8_15, 0x0C);
REG_AT_OFFSET(struct corepwm_regs, PWM1_POSEDGE, 0x10);
REG_AT_OFFSET(struct corepwm_regs, PWM1_NEGEDGE, 0x14);
REG_AT_OFFSET(struct corepwm_regs, PWM2_POSEDGE, 0x18);
REG_AT_OFFSET(struct corepwm_regs, PWM2_NEGEDGE, 0x1C);
REG_AT_OFFSET(struct corepwm_regs, PWM3_POSEDGE, 0x20);
REG_AT_OFFSET(struct corepwm_regs, PWM3_NEGEDGE, 0x24);
REG_AT_OFFSET(struct corepwm_regs, PWM4_POSEDGE, 0x28);
REG_AT_OFFSET(struct corepwm_regs, PWM4_NEGEDGE, 0x2C);
REG_AT_OFFSET(struct corepwm_regs, PWM5_POSEDGE, 0x30);
REG_AT_OFFSET(struct corepwm_regs, PWM5_NEGEDGE, 0x34);
REG_AT_OFFSET(struct corepwm_regs, PWM6_POSEDGE, 0x38);
REG_AT_OFFSET(struct corepwm_regs, PWM6_NEGEDGE, 0x3C);
REG_AT_OFFSET(struct corepwm_regs, PWM7_POSEDGE, 0x40);
REG_AT_OFFSET(struct corepwm_regs, PWM7_NEGEDGE, 0x44);
REG_AT_OFFSET(struct corepwm_regs, SYNC_UPDATE, 0xE4);

#define COREPWM_ENABLE_LEGS    0x3Fu /* PWM1...PWM6 */
#define COREPWM_ENABLE_TRIGGER 0x40u /* PWM7 */

#define COREPWM_PERIOD_MIN 32u
#define COREPWM_PERIOD_MAX 65536u

/* A read across FIC_0 takes several clocks, so this is longer than the longest period. */
#define COREPWM_WAIT_POLLS 65536u

/* Shortest on-time of a high side: with 0 its two edges were equal, and its output would toggle. */
#define COREPWM_ON_MIN 1u

/*
 * Range of the on-time, in counts of a period of `period_counts`, for which all twelve edges lie inside the period,
 * apart from each other, and the low sides still conduct at count 0, where the currents are sampled: the first edge,
 * (P - d)/2 - t, comes at count 1 or later, and the last, (P - d)/2 + d + t, at P - 1 or earlier.
 * dead_counts is the time between one side off and the other on. If the period is too short for it, the maximum is 0.
 */
static inline uint32_t corepwm_on_min(uint32_t period_counts, uint32_t dead_counts)
{
    (void)period_counts;
    (void)dead_counts;
    return COREPWM_ON_MIN;
}

static inline uint32_t corepwm_on_max(uint32_t period_counts, uint32_t dead_counts)
{
    const uint32_t taken = 2u * dead_counts + 2u;
    return period_counts > taken ? period_counts - taken : 0u;
}

/*
 * Sets up a period of `period_counts` fabric clocks (COREPWM_PERIOD_MIN ... COREPWM_PERIOD_MAX), disables the six
 * outputs, puts all three phases to half on-time with an eighth of the period of dead time, and starts the ADC trigger
 * at count 0. The edges are harmless and not meant to be used: call corepwm_write_legs() before corepwm_enable_legs().
 *
 * Waits for the new values to be in effect: a period of the old setting and one of the new. Returns false if the period
 * is out of range (nothing is changed then) or if the core does not take the values in time (the outputs stay
 * disabled). Context: thread; the waiting is bounded by COREPWM_WAIT_POLLS reads a step.
 */
bool corepwm_init(struct corepwm_regs *pwm, uint32_t period_counts);

/*
 * Lets the six outputs follow their edges, or holds them low, from the end of the running period on. The trigger keeps
 * running. Context: any.
 */
static inline void corepwm_enable_legs(struct corepwm_regs *pwm, bool on)
{
    pwm->PWM_ENABLE_0_7 = COREPWM_ENABLE_TRIGGER | (on ? COREPWM_ENABLE_LEGS : 0u);
}

/* Puts one on-time into [COREPWM_ON_MIN, on_max]; a negative number passed as unsigned counts as 0. */
static inline uint32_t corepwm_clamp_on(uint32_t on_counts, uint32_t on_max_counts)
{
    const int32_t on = (int32_t)on_counts;
    const int32_t max = (int32_t)on_max_counts;
    const int32_t low_checked = on < (int32_t)COREPWM_ON_MIN ? (int32_t)COREPWM_ON_MIN : on;
    return (uint32_t)(low_checked > max ? max : low_checked);
}

/*
 * New on-times of the three high sides, in counts, centred on half the period, in effect together from the next end of
 * a period on. on_x: any value; outside corepwm_on_min ... corepwm_on_max it is put to the nearer end.
 * period_counts: as given to corepwm_init(); dead_counts: any for which corepwm_on_max() is not 0, which the caller has
 * made sure of once.
 *
 * Context: one at a time. The drive calls it at start-up, with the outputs off; from then on the current loop writes the edges
 * itself. Straight code, no branch; with constant dead_counts and period_counts the limits cost nothing.
 */
static inline __attribute__((always_inline)) void corepwm_write_legs(struct corepwm_regs *pwm, uint32_t on_a,
                                                                     uint32_t on_b, uint32_t on_c, uint32_t dead_counts,
                                                                     uint32_t period_counts)
{
    const uint32_t on_max = period_counts - 2u * dead_counts - 2u;
    const uint32_t a = corepwm_clamp_on(on_a, on_max);
    const uint32_t b = corepwm_clamp_on(on_b, on_max);
    const uint32_t c = corepwm_clamp_on(on_c, on_max);
    const uint32_t rise_a = (period_counts - a) >> 1;
    const uint32_t rise_b = (period_counts - b) >> 1;
    const uint32_t rise_c = (period_counts - c) >> 1;

    pwm->SYNC_UPDATE = 0u; /* should the period end in between, none of the edges is taken, rather than some */
    pwm->PWM1_POSEDGE = rise_a;
    pwm->PWM1_NEGEDGE = rise_a + a;
    pwm->PWM2_POSEDGE = rise_a + a + dead_counts;
    pwm->PWM2_NEGEDGE = rise_a - dead_counts;
    pwm->PWM3_POSEDGE = rise_b;
    pwm->PWM3_NEGEDGE = rise_b + b;
    pwm->PWM4_POSEDGE = rise_b + b + dead_counts;
    pwm->PWM4_NEGEDGE = rise_b - dead_counts;
    pwm->PWM5_POSEDGE = rise_c;
    pwm->PWM5_NEGEDGE = rise_c + c;
    pwm->PWM6_POSEDGE = rise_c + c + dead_counts;
    pwm->PWM6_NEGEDGE = rise_c - dead_counts;
    pwm->SYNC_UPDATE = 1u;
}

#endif

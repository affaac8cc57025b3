/* SPDX-License-Identifier: MIT */
/*
 * PWM in fabric slot 0: three half bridges on one centred carrier, and the ADC's triggers. Registers: docs/fabric.md, slot 0.
 *
 * The block makes dead times and minimum pulses by itself; each phase has one compare, half of its on-time in counts, and a
 * write to phase C's hands over all three. Settings that the legs depend on can be written only while the carrier rests: writes
 * while it runs are ignored.
 *
 * The carrier runs from start-up on, since the ADC's triggers come from it. The bridge's switch is GATE: gate.h.
 */
#ifndef DRIVERS_FABRIC_PWM_H
#define DRIVERS_FABRIC_PWM_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/board.h"
#include "drivers/reg.h"

struct pwm_regs {
    volatile uint32_t CONTROL;
    const volatile uint32_t STATUS;
    volatile uint32_t PERIOD;
    volatile uint32_t DEAD;
    volatile uint32_t MIN_PULSE;
    volatile uint32_t MODE;
    volatile uint32_t PHASE;
    volatile uint32_t TRIGGER_1;
    volatile uint32_t TRIGGER_2;
    const volatile uint32_t COUNT;
    volatile uint32_t COMPARE_A;
    volatile uint32_t COMPARE_B;
    volatile uint32_t COMPARE_C;
};

#define PWM_CONTROL_RUN      (1u << 0)
#define PWM_CONTROL_BRAKE    (1u << 1)
#define PWM_CONTROL_FOLLOW   (1u << 2)
#define PWM_STATUS_RUNNING   (1u << 0)
#define PWM_STATUS_RISING    (1u << 1)
#define PWM_STATUS_WAITING   (1u << 2)
#define PWM_STATUS_FELL_BACK (7u << 4) /* any phase */
#define PWM_PHASE_RISING     (1u << 16)
#define PWM_TRIGGER_FALLING  (1u << 16)
#define PWM_TRIGGER_RISING   (1u << 17)

/* Half a period in counts: shorter ones have no room for a trigger and an interrupt, longer ones no bits. */
#define PWM_HALF_MIN 16u
#define PWM_HALF_MAX 65535u

/* When a set of compares takes effect. */
enum pwm_update {
    PWM_UPDATE_VALLEY, /* in the middle of the low sides' time */
    PWM_UPDATE_ENDS,   /* there and in the middle of the high sides' time */
    PWM_UPDATE_ONCE,   /* at once, for each phase that can; otherwise at the next end */
};

struct pwm_setup {
    uint32_t half_counts;      /* half a period, PWM_HALF_MIN ... PWM_HALF_MAX fabric clocks */
    uint32_t dead_counts;      /* 1 ... 255 */
    uint32_t min_pulse_counts; /* 1 ... 255 */
    enum pwm_update update;
    uint32_t ahead_counts; /* of the first axis's carrier, to follow it, half a period at most; 0: runs by itself */
};

/*
 * Stops the PWM, sets it up and starts it, all phases at half on-time. The ADC is triggered once a period, in the middle of the
 * low sides' conduction: dead time delays each turn-on edge, so this middle lies half a dead time after the valley, and that of
 * the high sides as far after the peak.
 *
 * Returns false, with the PWM at rest, if a value is out of range, the carrier does not come to rest, or a register does not
 * read back. The conversions show whether it runs. Context: thread.
 */
bool pwm_init(struct pwm_regs *pwm, const struct pwm_setup *setup);

/*
 * Changes only the update mode; writes nothing if it is the present one. The carrier rests for the write, so the bridge must
 * be off, and resumes where it stopped: one period is some 50 clocks longer. A carrier that follows another rests in any case
 * and starts anew with it: that puts right what the other's rests have shifted. Returns false, with the PWM at rest, if that
 * fails. Near an end it waits, for 5 us at most. Context: any that the current loop's interrupt may preempt, while nobody else
 * sets up the PWM.
 */
bool pwm_set_update(struct pwm_regs *pwm, enum pwm_update update);

/*
 * Sets the samples per period: 1, in the middle of the low sides' time, or 2, also in that of the high sides' time; each
 * triggered `early_counts` before it, less than half a period, to allow for sensor delay. In effect at once, whatever the
 * carrier does. Returns false if a register does not read back. Context: any, while nobody else sets up the PWM.
 */
bool pwm_set_samples(struct pwm_regs *pwm, uint32_t samples, uint32_t early_counts);

/* True if a phase of the newest compares could not act at once and waited for the next end. Any context. */
static inline bool pwm_fell_back(const struct pwm_regs *pwm)
{
    return (pwm->STATUS & PWM_STATUS_FELL_BACK) != 0u;
}

#endif

/* SPDX-License-Identifier: MIT */
/*
 * CorePWM: bringing it up. The order matters because the core is already counting, see corepwm.h.
 */
#include "drivers/fabric/corepwm.h"

/* Reads give the value in effect: waits until a register shows what was written to it. */
static bool takes_effect(const volatile uint32_t *reg, uint32_t value)
{
    for (uint32_t poll = 0; poll < COREPWM_WAIT_POLLS; poll++) {
        if (*reg == value) {
            return true;
        }
    }
    return false;
}

bool corepwm_init(struct corepwm_regs *pwm, uint32_t period_counts)
{
    if (period_counts < COREPWM_PERIOD_MIN || period_counts > COREPWM_PERIOD_MAX) {
        return false;
    }

    /* First the outputs: from reset all edges are equal, and an enabled channel would toggle. */
    pwm->PWM_ENABLE_0_7 = 0u;
    pwm->PWM_ENABLE_8_15 = 0u;
    if (!takes_effect(&pwm->PWM_ENABLE_0_7, 0u)) {
        return false;
    }

    /* Then the time base, before any edge: under the old, short period the new edges would never come. */
    pwm->PRESCALE = 0u;
    pwm->PERIOD = period_counts - 1u;
    if (!takes_effect(&pwm->PRESCALE, 0u) || !takes_effect(&pwm->PERIOD, period_counts - 1u)) {
        return false;
    }

    /* Then the edges, which the first period with SYNC_UPDATE 1 brings into effect, the trigger's last. */
    pwm->SYNC_UPDATE = 0u;
    pwm->PWM7_POSEDGE = 0u;
    pwm->PWM7_NEGEDGE = period_counts / 2u;
    const uint32_t half = period_counts / 2u;
    corepwm_write_legs(pwm, half, half, half, period_counts / 8u, period_counts);
    if (!takes_effect(&pwm->PWM7_NEGEDGE, half)) {
        return false;
    }

    pwm->PWM_ENABLE_0_7 = COREPWM_ENABLE_TRIGGER;
    return takes_effect(&pwm->PWM_ENABLE_0_7, COREPWM_ENABLE_TRIGGER);
}

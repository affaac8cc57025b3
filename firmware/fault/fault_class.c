/* SPDX-License-Identifier: MIT */
#include "firmware/fault/fault.h"

#include "drivers/fabric/adc.h"
#include "drivers/fabric/gate.h"
#include "firmware/settings/features.h"

#define OFF    (1u << REACTION_OFF)
#define STOP   (1u << REACTION_STOP)
#define WARN   (1u << REACTION_WARN)
#define CARRY  (FEATURE_IN(SENSORLESS) ? 1u << REACTION_CARRY : 0u)
#define SLOWER (1u << REACTION_CARRY)

/*
 * A stop needs a working current loop, encoder and bridge. A warning is allowed if going on does no harm by itself. Retry is
 * for what may pass: a supply, a load, heat.
 */
static const struct fault_class classes[FAULT_COUNT] = {
    [FAULT_ENCODER] = {OFF | CARRY, REACTION_OFF, false},
    [FAULT_OVERCURRENT] = {OFF, REACTION_OFF, true},
    [FAULT_OVERVOLTAGE] = {OFF, REACTION_OFF, true},
    [FAULT_UNDERVOLTAGE] = {OFF, REACTION_OFF, true},
    [FAULT_OVERSPEED] = {OFF | STOP, REACTION_OFF, false},
    [FAULT_STALL] = {OFF | WARN, REACTION_OFF, true},
    [FAULT_ENCODER_SLIP] = {OFF | CARRY, REACTION_OFF, false},
    [FAULT_ENCODER_DEAD] = {OFF | CARRY, REACTION_OFF, false},
    [FAULT_ENCODER_COUNTS] = {OFF | STOP | WARN | CARRY, REACTION_OFF, false},
    [FAULT_SPEED_DEVIATION] = {OFF | STOP | WARN, REACTION_OFF, true},
    [FAULT_OVERTEMPERATURE] = {OFF | STOP | WARN, REACTION_STOP, true},
    [FAULT_INVERTER_OVERLOAD] = {OFF | STOP | WARN, REACTION_STOP, true},
    [FAULT_VOLTAGE_LIMIT] = {OFF | STOP | WARN, REACTION_WARN, true},
    [FAULT_OSCILLATION] = {OFF | STOP | WARN | SLOWER, REACTION_CARRY, false},
    [FAULT_LIMIT_CYCLE] = {OFF | STOP | WARN, REACTION_OFF, false},
    [FAULT_FOLLOWING_ERROR] = {OFF | STOP | WARN, REACTION_STOP, false},
    [FAULT_HOMING] = {OFF | STOP, REACTION_STOP, false},
    [FAULT_LOCK_LOST] = {OFF, REACTION_OFF, true},
    [FAULT_OUT_OF_STEP] = {OFF, REACTION_OFF, true},
    [FAULT_HALL_INVALID] = {OFF | CARRY, REACTION_OFF, true},
    [FAULT_HALL_SEQUENCE] = {OFF | CARRY, REACTION_OFF, true},
    [FAULT_COMMAND_TIMEOUT] = {OFF | STOP | WARN, REACTION_STOP, false},
    [FAULT_MASTER_LOST] = {OFF | STOP | WARN, REACTION_STOP, false},
    [FAULT_THREAD_STOPPED] = {OFF | STOP, REACTION_STOP, false},
};

const struct fault_class *fault_class(enum fault cause)
{
    static const struct fault_class off_only = {OFF, REACTION_OFF, false};
    return cause < FAULT_COUNT && classes[cause].allowed != 0u ? &classes[cause] : &off_only;
}

bool fault_choice_is_absent(enum fault cause, enum reaction choice)
{
    return !FEATURE_IN(SENSORLESS) && choice == REACTION_CARRY && cause != FAULT_OSCILLATION;
}

/* Safe torque off first: it may well come with a loss of the drivers' supply. No loop: the interrupt's time is bounded. */
enum fault fault_from_gate(uint32_t gate_flags)
{
    if ((gate_flags & GATE_STATUS_STO_A) != 0u) {
        return FAULT_STO_A;
    }
    if ((gate_flags & GATE_STATUS_STO_B) != 0u) {
        return FAULT_STO_B;
    }
    if ((gate_flags & GATE_STATUS_CLOCK_LOST) != 0u) {
        return FAULT_PLL;
    }
    if ((gate_flags & GATE_STATUS_OVERCURRENT) != 0u) {
        return FAULT_OVERCURRENT_HARDWARE;
    }
    if ((gate_flags & GATE_STATUS_DRIVER_FAULT) != 0u) {
        return FAULT_GATE_DRIVER;
    }
    if ((gate_flags & GATE_STATUS_INTERLOCK) != 0u) {
        return FAULT_INTERLOCK;
    }
    if ((gate_flags & GATE_STATUS_LOOP_LOST) != 0u) {
        return FAULT_LOOP_OVERRUN;
    }
    return (gate_flags & (GATE_STATUS_SLOW_LOST | GATE_STATUS_THREAD_LOST)) != 0u ? FAULT_SLOW_LOOP_STOPPED
                                                                                  : FAULT_NONE;
}

enum fault fault_from_adc(uint32_t adc_flags)
{
    if ((adc_flags & ADC_STATUS_CURRENT) != 0u) {
        return FAULT_OVERCURRENT;
    }
    if ((adc_flags & ADC_STATUS_SUM) != 0u) {
        return FAULT_CURRENT_SUM;
    }
    if ((adc_flags & ADC_STATUS_VBUS_HIGH) != 0u) {
        return FAULT_OVERVOLTAGE;
    }
    return (adc_flags & ADC_STATUS_VBUS_LOW) != 0u ? FAULT_UNDERVOLTAGE : FAULT_NONE;
}

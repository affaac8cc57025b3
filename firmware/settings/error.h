/* SPDX-License-Identifier: MIT */
/*
 * Why a request was refused, shared by all parts of the firmware. firmware/operate/messages.c has the texts, so every interface
 * reports the same.
 */
#ifndef FIRMWARE_SETTINGS_ERROR_H
#define FIRMWARE_SETTINGS_ERROR_H

#include <stdint.h>

enum error {
    ERROR_NONE,
    /* inconsistent parameters */
    ERROR_CURRENT_GAIN,
    ERROR_CURRENT_INTEGRAL_GAIN,
    ERROR_DECOUPLING,
    ERROR_SPEED_GAIN,
    ERROR_I_TRIP_BEYOND_RANGE,
    ERROR_I_MAX_BEYOND_TRIP,
    ERROR_I_ALIGN_BEYOND_MAX,
    ERROR_V_LIMITS,
    ERROR_CHOPPER_LEVELS,
    ERROR_SPEED_MAX_BEYOND_OVERSPEED,
    ERROR_V_MIN_BELOW_MODULATOR,
    ERROR_SAMPLES_OF_SHUNTS,
    ERROR_SAMPLES_AT_VALLEY,
    ERROR_SAMPLES_TOO_FAST,
    ERROR_OVERMODULATION_OF_SHUNTS,
    ERROR_MODULATOR_OSR,
    ERROR_MODULATOR_OF_SHUNTS,
    ERROR_MODULATOR_TOO_SLOW,
    ERROR_SPEED_BEYOND_OBSERVER,
    ERROR_OBSERVER,
    ERROR_SENSORLESS_RELUCTANT,
    ERROR_INJECTION_UPDATE,
    ERROR_HALL_STATES,
    ERROR_HALL_EDGES,
    ERROR_ENCODER_COARSE, /* value: the fewest counts that work */
    /* bandwidths that leave too little margin; value: the largest that works, Hz */
    ERROR_CURRENT_MARGIN,
    ERROR_SPEED_MARGIN,
    ERROR_SPEED_RESOLUTION,
    ERROR_SPEED_UNRESOLVED, /* none works */
    ERROR_CURRENT_TOO_SLOW, /* none works */
    ERROR_POSITION_MARGIN,
    ERROR_EMF_BEYOND_V_MAX, /* value: the largest overspeed_rpm that works */
    /* the state does not allow it */
    ERROR_FAULT_LATCHED,
    ERROR_ALREADY_ON,
    ERROR_NOT_OPERATING,
    ERROR_NEEDS_ENCODER,
    ERROR_NEEDS_HALL,
    ERROR_NO_FAULT,
    ERROR_DRIVE_IS_ON,
    ERROR_BUSY, /* an earlier request is still pending */
    /* conditions at the time of the request */
    ERROR_BUS_LOW,
    ERROR_BUS_HIGH,
    ERROR_TURNING,
    ERROR_BEYOND_SPEED_MAX,
    ERROR_BEYOND_I_MAX,
    ERROR_BEYOND_CYCLE,
    ERROR_HOME_SPEED,
    ERROR_HOMING,
    ERROR_LEARNING,
    ERROR_LEARN_SPEED,
    ERROR_TOO_HOT,
    ERROR_REACTION_NOT_ALLOWED,
    /* stored settings */
    ERROR_NOTHING_STORED,
    ERROR_STORED_FORMAT,
    ERROR_STORED_RANGE,
    ERROR_SAVE_WHILE_ON,
    ERROR_SAVE_FULL,
    ERROR_ENVM_CLOCK,
    ERROR_ENVM_NOT_GRANTED,
    ERROR_ENVM_TIMED_OUT,
    ERROR_ENVM_DENIED,
    ERROR_ENVM_BUSY,
    ERROR_ENVM_LOCKED,
    ERROR_ENVM_ERASE,
    ERROR_ENVM_WRITE,
    ERROR_ENVM_VERIFY,
    /* why a fault cannot be cleared */
    ERROR_GATE_INPUT_ACTIVE,
    ERROR_NO_ENCODER_SIGNAL,
    ERROR_FABRIC,
    ERROR_CLOCK,
    ERROR_STACK_GUARD,
    ERROR_WATCHDOG_OFF,
    ERROR_FABRIC_DOUBTED, /* found at start-up; only a reset checks again */
    /* scope */
    ERROR_SCOPE_ARMED,
    ERROR_SCOPE_NOT_ARMED,
    ERROR_SCOPE_BEFORE, /* value: the most that works */
    /* switching on */
    ERROR_SWITCHED_OFF, /* meanwhile */
    /* switching the angle source */
    ERROR_SOURCE_MODE,
    ERROR_SOURCE_WEAKENS,
    ERROR_SOURCE_RELUCTANT,
    ERROR_SOURCE_FIELD,
    ERROR_SOURCE_ENCODER,
    ERROR_SOURCE_HALL,
    ERROR_SOURCE_SLOW,   /* value: rpm that would do */
    ERROR_SOURCE_MARGIN, /* value: rpm that would do */
    ERROR_SOURCE_APART,  /* value: degrees */
    /* the build */
    ERROR_NOT_IN_BUILD, /* value: enum feature */
    ERROR_COUNT
};

/* `value` completes messages with a number: the limit, or what would work, in the text's unit. */
struct outcome {
    enum error error;
    int32_t value;
};

static inline struct outcome outcome_of(enum error error)
{
    return (struct outcome){error, 0};
}

#define OUTCOME_OK outcome_of(ERROR_NONE)

#endif

/* SPDX-License-Identifier: MIT */
/*
 * Why a request was refused, shared by all parts of the firmware. firmware/operate/messages.c has the texts, so every interface
 * reports the same; the remark here says what would help (docs/reference.md). The numbers are those of the Modbus register
 * `refusal`: a new one gets the next number, and none is used twice (tests/unit/numbers.toml).
 */
#ifndef FIRMWARE_SETTINGS_ERROR_H
#define FIRMWARE_SETTINGS_ERROR_H

#include <stdint.h>

enum error {
    ERROR_NONE = 0,
    /* inconsistent parameters */
    ERROR_CURRENT_GAIN = 1,                /* inductances of one phase in uH, or a smaller current_bw_hz */
    ERROR_CURRENT_INTEGRAL_GAIN = 2,       /* the resistance of one phase, or another current_bw_hz */
    ERROR_DECOUPLING = 3,                  /* the flux in uWb, or another power stage */
    ERROR_SPEED_GAIN = 4,                  /* inertia_gmm2 of rotor and load, flux_uwb; another speed_bw_hz */
    ERROR_I_TRIP_BEYOND_RANGE = 5,         /* a smaller i_trip_ma */
    ERROR_I_MAX_BEYOND_TRIP = 6,           /* a smaller i_max_ma or a larger i_trip_ma */
    ERROR_I_ALIGN_BEYOND_MAX = 7,          /* a smaller i_align_ma */
    ERROR_V_LIMITS = 8,                    /* v_min_mv and v_max_mv around the supply's voltage */
    ERROR_CHOPPER_LEVELS = 9,              /* levels between the supply's voltage and v_max_mv, or 0 for no chopper */
    ERROR_SPEED_MAX_BEYOND_OVERSPEED = 10, /* a smaller speed_max_rpm or a larger overspeed_rpm */
    ERROR_V_MIN_BELOW_MODULATOR = 11,      /* a larger v_min_mv */
    ERROR_SAMPLES_OF_SHUNTS = 12,          /* pwm_samples 1; or low_side_shunts 0 if the sensors are in line */
    ERROR_SAMPLES_AT_VALLEY = 13,          /* pwm_update 1 or 2 */
    ERROR_SAMPLES_TOO_FAST = 14,           /* pwm_samples 1, or an image for a lower PWM rate */
    ERROR_OVERMODULATION_OF_SHUNTS = 15,   /* overmodulation 0; or low_side_shunts 0 if the sensors are in line */
    ERROR_MODULATOR_OSR = 16,              /* one of these ratios */
    ERROR_MODULATOR_OF_SHUNTS = 17,        /* low_side_shunts 0: a modulator's filter needs the whole period */
    ERROR_MODULATOR_TOO_SLOW = 18,         /* a smaller modulator_osr, or pwm_samples 1 */
    ERROR_SPEED_BEYOND_OBSERVER = 19,      /* a smaller overspeed_rpm */
    ERROR_OBSERVER = 20,                   /* these four by the data sheet, or by `identify` */
    ERROR_SENSORLESS_RELUCTANT = 21,       /* injection_mv, or an encoder */
    ERROR_INJECTION_UPDATE = 22,           /* pwm_update 0 or 2 */
    ERROR_HALL_STATES = 23,                /* `learn hall`, or the order in the data sheet */
    ERROR_HALL_EDGES = 24,                 /* `learn hall` */
    ERROR_ENCODER_COARSE = 25,             /* an encoder with more counts, or another angle_source */
    /* bandwidths that leave too little margin */
    ERROR_CURRENT_MARGIN = 26,   /* a smaller current_bw_hz, or pwm_update 2 */
    ERROR_SPEED_MARGIN = 27,     /* a smaller speed_bw_hz, or a larger current_bw_hz */
    ERROR_SPEED_RESOLUTION = 28, /* a smaller speed_bw_hz */
    ERROR_SPEED_UNRESOLVED = 29, /* an encoder with more counts, or a smaller i_max_ma */
    ERROR_CURRENT_TOO_SLOW = 30, /* a larger current_bw_hz */
    ERROR_POSITION_MARGIN = 31,  /* a smaller position_bw_hz */
    ERROR_EMF_BEYOND_V_MAX = 32, /* a smaller overspeed_rpm, or a power stage that withstands it */
    /* the state does not allow it */
    ERROR_FAULT_LATCHED = 33, /* `fault` says what to look at */
    ERROR_ALREADY_ON = 34,    /* `off` first, if it is to begin anew */
    ERROR_NOT_OPERATING = 35, /* `on`; `status` says how far it is */
    ERROR_NEEDS_ENCODER = 36, /* an encoder, and angle_source 0 */
    ERROR_NEEDS_HALL = 37,    /* `set angle_source 2` */
    ERROR_NO_FAULT = 38,      /* nothing to do */
    ERROR_DRIVE_IS_ON = 39,   /* `off` first */
    ERROR_BUSY = 40,          /* the same again, a millisecond later */
    /* conditions at the time of the request */
    ERROR_BUS_LOW = 41,  /* the supply, or v_min_mv */
    ERROR_BUS_HIGH = 42, /* the supply, or v_max_mv */
    ERROR_TURNING = 43,  /* wait, close the brake; or angle_source 1 or 2, whose start catches a turning rotor */
    ERROR_BEYOND_SPEED_MAX = 44,     /* a smaller speed, or a larger speed_max_rpm */
    ERROR_BEYOND_I_MAX = 45,         /* a smaller current, or a larger i_max_ma */
    ERROR_BEYOND_CYCLE = 46,         /* smaller steps, or a larger cyclic_ms */
    ERROR_HOME_SPEED = 47,           /* a home_rpm other than 0, within speed_max_rpm */
    ERROR_HOMING = 48,               /* wait for its end, or `off` */
    ERROR_LEARNING = 49,             /* wait for its end, or `off` */
    ERROR_LEARN_SPEED = 50,          /* a smaller learn_rpm */
    ERROR_TOO_HOT = 51,              /* wait until it has cooled */
    ERROR_REACTION_NOT_ALLOWED = 52, /* one of those that `reaction` lists */
    /* stored settings */
    ERROR_NOTHING_STORED = 53,   /* `save` first */
    ERROR_STORED_FORMAT = 54,    /* the firmware that stored it, or `save` anew */
    ERROR_STORED_RANGE = 55,     /* set what does not fit, then `save` */
    ERROR_SAVE_WHILE_ON = 56,    /* `off` first */
    ERROR_SAVE_FULL = 57,        /* a smaller cogging map: learn again */
    ERROR_ENVM_CLOCK = 58,       /* clocks as in drivers/board.h */
    ERROR_ENVM_NOT_GRANTED = 59, /* again; then look for what else uses the eNVM */
    ERROR_ENVM_TIMED_OUT = 60,   /* again */
    ERROR_ENVM_DENIED = 61,      /* a design that leaves these pages unprotected */
    ERROR_ENVM_BUSY = 62,        /* again */
    ERROR_ENVM_LOCKED = 63,      /* unlock the pages with a programmer */
    ERROR_ENVM_ERASE = 64,       /* the supply; another device if it stays */
    ERROR_ENVM_WRITE = 65,       /* the supply; another device if it stays */
    ERROR_ENVM_VERIFY = 66,      /* again; another device if it stays */
    /* why a fault cannot be cleared */
    ERROR_GATE_INPUT_ACTIVE = 67, /* the driver's fault line, safe torque off, the comparators */
    ERROR_NO_ENCODER_SIGNAL = 68, /* the encoder's cable and supply */
    ERROR_FABRIC = 69,            /* program the design of docs/fabric.md */
    ERROR_CLOCK = 70,             /* Libero's clock settings as in drivers/board.h */
    ERROR_STACK_GUARD = 71,       /* reset; the memory protection unit switched on in Libero */
    ERROR_WATCHDOG_OFF = 72,      /* the watchdog switched on in Libero, in reset mode */
    ERROR_FABRIC_DOUBTED = 73,    /* mend what `fault` names, then reset */
    /* scope */
    ERROR_SCOPE_ARMED = 74,     /* `scope off` first */
    ERROR_SCOPE_NOT_ARMED = 75, /* `scope arm` first */
    ERROR_SCOPE_BEFORE = 76,    /* fewer samples before the trigger, or fewer signals */
    /* switching on */
    ERROR_SWITCHED_OFF = 77, /* `on` again, if that was not meant */
    /* switching the angle source */
    ERROR_SOURCE_MODE = 78,      /* `speed` or `torque` first */
    ERROR_SOURCE_WEAKENS = 79,   /* a smaller speed_max_rpm, and overmodulation 0 */
    ERROR_SOURCE_RELUCTANT = 80, /* `off`, then `on` with angle_source 1 and injection_mv */
    ERROR_SOURCE_FIELD = 81,     /* a higher speed */
    ERROR_SOURCE_ENCODER = 82,   /* the encoder's cable and supply */
    ERROR_SOURCE_HALL = 83,      /* the switches' wires and supply, or `learn hall` */
    ERROR_SOURCE_SLOW = 84,      /* a higher speed */
    ERROR_SOURCE_MARGIN = 85,    /* a higher speed or less current */
    ERROR_SOURCE_APART = 86,     /* `off` and `on`, or `learn hall` */
    /* the build */
    ERROR_NOT_IN_BUILD = 87, /* an image with that feature */
    /* sweep */
    ERROR_SWEEPING = 88,        /* `sweep off`, or wait for its end */
    ERROR_SWEEP_MODE = 89,      /* `speed` or `pp` first */
    ERROR_SWEEP_AMPLITUDE = 90, /* a smaller amplitude */
    /* two axes */
    ERROR_SAVE_BESIDE_ON = 91,  /* the other axis off and at rest first */
    ERROR_AXIS_RANGE = 92,      /* a number that there is */
    ERROR_SCOPE_ELSEWHERE = 93, /* `axis` with this axis' number first: the scope goes with it */
    ERROR_IDENTIFY_BESIDE = 94, /* wait for its end, or the other axis off */
    ERROR_CATCHES_BESIDE = 95,  /* wait until the other axis operates */
    /* parameters of the motor that do not fit each other */
    ERROR_LD_APPARENT = 96, /* both d inductances of one phase at rated current, or 0 */
    ERROR_LQ_APPARENT = 97, /* both q inductances of one phase at rated current, or 0 */
    ERROR_LQ_REST = 98,     /* both q inductances of one phase, or 0 */
    ERROR_INERTIA = 99,     /* inertia_gmm2 of rotor and load: 1 kg cm2 is 100000 g mm2; a smaller speed_max_rpm */
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

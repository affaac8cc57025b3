/* SPDX-License-Identifier: MIT */
/*
 * Faults: one list of causes, and the latch. fault_raise() shuts the gates, then latches the first cause with a snapshot of the
 * drive at that instant. The current loop's interrupt may preempt a call from a lower level; then the interrupt's cause stays.
 *
 * The order is the priority between causes seen in the same sample: what hardware found comes before what software concludes
 * from it. docs/faults.md has a line for each. The numbers are those on the bus: a new one gets the next number, and none is
 * used twice (tests/unit/numbers.toml).
 */
#ifndef FIRMWARE_FAULT_FAULT_H
#define FIRMWARE_FAULT_FAULT_H

#include <stdbool.h>
#include <stdint.h>

struct axis;

enum fault {
    FAULT_NONE = 0,
    FAULT_STO_A = 1,                /* first safe-torque-off input; the fabric has switched off already */
    FAULT_STO_B = 2,                /* second input */
    FAULT_OVERCURRENT_HARDWARE = 3, /* the power stage's comparators; the fabric has switched off already */
    FAULT_GATE_DRIVER = 4,          /* the gate driver's fault pin */
    FAULT_INTERLOCK = 5,            /* both sides of a phase commanded on */
    FAULT_LOOP_OVERRUN = 6,         /* a sample was not taken within its PWM period */
    FAULT_ENCODER = 7,              /* signal lost, or an impossible transition */
    FAULT_OVERCURRENT = 8,          /* a phase current beyond i_trip */
    FAULT_CURRENT_SUM = 9,          /* the three phase currents do not add up to zero */
    FAULT_OVERVOLTAGE = 10,         /* the bus above v_max */
    FAULT_UNDERVOLTAGE = 11,        /* the bus below v_min while the bridge is on */
    FAULT_OVERSPEED = 12,           /* the shaft beyond overspeed_rpm */
    FAULT_CURRENT_OFFSET = 13,      /* a current sensor's zero is out of range */
    FAULT_STALL = 14,               /* full current, no motion */
    FAULT_LOOP_STOPPED = 15,        /* the current loop's interrupt has gone silent, or comes too often */
    FAULT_WATCHDOG = 16,            /* the last reset came from the watchdog */
    FAULT_EXCEPTION = 17,           /* the last reset followed a processor fault; the console has the details */
    FAULT_CLOCK = 18,               /* the clocks do not match the board header, or are not locked */
    FAULT_FABRIC = 19,              /* the fabric does not carry the expected design */
    FAULT_LOCKUP = 20,              /* the last reset came from a lock-up: a fault inside a fault handler */
    FAULT_STACK_GUARD = 21,         /* the memory protection below the stack is not in effect */
    FAULT_WATCHDOG_OFF = 22,        /* the watchdog is off, or does not reset */
    FAULT_PLL = 23,                 /* a PLL lost its lock while the program ran */
    FAULT_ECC = 24,                 /* an uncorrectable memory error while the program ran */
    FAULT_ENCODER_SLIP = 25,        /* the counted angle is not the rotor's */
    FAULT_ENCODER_DEAD = 26,        /* no counts although the rotor turns */
    FAULT_ENCODER_COUNTS = 27,      /* the index does not come where the count says */
    FAULT_OPEN_PHASE = 28,          /* a phase that should carry current does not */
    FAULT_SPEED_DEVIATION = 29,     /* the speed has left its reference */
    FAULT_OVERTEMPERATURE = 30,     /* the winding is beyond t_max */
    FAULT_INVERTER_OVERLOAD = 31,   /* I2t of the power stage */
    FAULT_VOLTAGE_LIMIT = 32,       /* the bus voltage cannot drive the requested current */
    FAULT_LIMIT_CYCLE = 33,         /* the speed loop oscillates by itself */
    FAULT_COMMAND_TIMEOUT = 34,     /* no command for too long */
    FAULT_ROTOR_TURNING = 35,       /* start: the rotor did not come to rest */
    FAULT_SENSOR_SIGN = 36,         /* start: a current sensor counts backwards */
    FAULT_ENCODER_DIRECTION = 37,   /* start: encoder reversed or phase order wrong, which look alike */
    FAULT_POLE_PAIRS = 38,          /* start: pole_pairs does not fit the encoder's counts */
    FAULT_ROTOR_BLOCKED = 39,       /* start: the rotor does not follow the field */
    FAULT_LOAD_TOO_HIGH = 40,       /* start: the load pulls the rotor out of the field */
    FAULT_GATES_OFF = 41,           /* the fabric switched the gates off but latched no cause */
    FAULT_FOLLOWING_ERROR = 42,     /* the shaft is not where it should be */
    FAULT_HOMING = 43,              /* the search for index or hard stop found nothing */
    FAULT_LOCK_LOST = 44,           /* without an encoder: the observer has lost the rotor */
    FAULT_OUT_OF_STEP = 45,         /* without an encoder: the rotor has fallen out of step with the prescribed field */
    FAULT_SALIENCY = 46,            /* start: the current does not show the rotor's position */
    FAULT_POLARITY = 47,            /* start: cannot tell which end of the rotor's axis is north */
    FAULT_HALL_INVALID = 48,        /* the Hall switches show a state that hall_states does not have */
    FAULT_HALL_SEQUENCE = 49,       /* they skip a sector, or the EMF is elsewhere */
    FAULT_HALL_UNKNOWN = 50,        /* `learn hall`: did not find their table */
    FAULT_SLOW_LOOP_STOPPED = 51,   /* no proof of life of the slow loop; the fabric has switched off already */
    FAULT_THREAD_STOPPED = 52,      /* console and buses made no progress for 100 ms; a controlled stop */
    FAULT_OSCILLATION = 53, /* the speed loop swings with its shaft: a coupling, or an inertia far from what was told */
    FAULT_MASTER_LOST = 54, /* the master of the CAN bus no longer commands it */
    FAULT_OFFSET = 55,      /* the remembered angle between encoder and magnets is not the rotor's */
    FAULT_SENSORS_EXCHANGED = 56,  /* start: a current sensor shows another phase's current */
    FAULT_TEMPERATURE_SENSOR = 57, /* the winding's temperature sensor shows what cannot be */
    FAULT_COUNT
};

/* True if a start-up fault leaves the fabric's identity or clock in doubt: then none of its registers may be touched. */
static inline bool fault_doubts_fabric(enum fault cause)
{
    return cause == FAULT_CLOCK || cause == FAULT_FABRIC;
}

struct fault_snapshot {
    uint64_t up_ms;
    uint32_t state; /* enum axis_state */
    int32_t i_a_q15, i_b_q15, i_c_q15;
    int32_t i_d_q15, i_q_q15;
    int32_t vbus_q15;
    int32_t speed_rpm_q4;
    uint32_t angle_u16;
    uint32_t gate_status;
};

struct fault_record {
    volatile uint32_t cause; /* enum fault: the first, until cleared */
    volatile uint32_t count; /* of all that were latched: one that is cleared again leaves its mark */
    int32_t detail[2];       /* details of the cause; message_fault_detail() says what they mean */
    struct fault_snapshot snapshot;
};

/* Reactions to a fault. Each class allows some; hardware faults and those that leave the motor uncontrolled, only the first. */
enum reaction {
    REACTION_OFF,  /* bridge off at once */
    REACTION_STOP, /* quick stop, then off; the fault is still latched */
    REACTION_WARN, /* operation goes on, the console reports it once */
    REACTION_CARRY, /* the same, with less: without the encoder, if the observer sees the rotor (drive/failover.h; else stop or
                       off); with a slower speed loop (control/oscillation.h; else off) */
    REACTION_COUNT
};

struct fault_class {
    uint8_t allowed; /* one bit per enum reaction */
    uint8_t initial; /* enum reaction */
    bool retry;      /* may be cleared and tried again without a person */
};

/* Never NULL; an unknown cause gets the class that allows only off. Any context. */
const struct fault_class *fault_class(enum fault cause);

/* The observer that this choice needs is not in the image. Any context. */
bool fault_choice_is_absent(enum fault cause, enum reaction choice);

/* The cause behind the gate block's latches; FAULT_NONE when none is set. */
enum fault fault_from_gate(uint32_t gate_flags);

/* The cause behind the ADC block's flags; FAULT_NONE when none is set. */
enum fault fault_from_adc(uint32_t adc_flags);

/*
 * Shuts the gates, and latches the cause with a snapshot if it is the first. Any context. The same with the cause's details:
 * fault_record.detail.
 */
void fault_raise(struct axis *a, enum fault cause);
void fault_raise_with(struct axis *a, enum fault cause, int32_t detail_0, int32_t detail_1);

/* Latches without shutting the gates, for a controlled stop; returns true if it was the first. Any context. */
bool fault_latch(struct axis *a, enum fault cause, int32_t detail_0, int32_t detail_1);

/* The operator, or a retry, has cleared it: the bridge may be enabled again. Slow loop. */
void fault_forget(struct axis *a);

#endif

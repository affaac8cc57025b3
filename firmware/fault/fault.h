/* SPDX-License-Identifier: MIT */
/*
 * Faults: one list of causes, and the latch. fault_raise() shuts the gates, then latches the first cause with a snapshot of the
 * drive at that instant. The current loop's interrupt may preempt a call from a lower level; then the interrupt's cause stays.
 *
 * The order is the priority between causes seen in the same sample: what hardware found comes before what software concludes
 * from it. docs/faults.md has a line for each.
 */
#ifndef FIRMWARE_FAULT_FAULT_H
#define FIRMWARE_FAULT_FAULT_H

#include <stdbool.h>
#include <stdint.h>

struct axis;

enum fault {
    FAULT_NONE,
    FAULT_STO_A,                /* first safe-torque-off input; the fabric has switched off already */
    FAULT_STO_B,                /* second input */
    FAULT_OVERCURRENT_HARDWARE, /* the power stage's comparators; the fabric has switched off already */
    FAULT_GATE_DRIVER,          /* the gate driver's fault pin */
    FAULT_INTERLOCK,            /* both sides of a phase commanded on */
    FAULT_LOOP_OVERRUN,         /* a sample was not taken within its PWM period */
    FAULT_ENCODER,              /* signal lost, or an impossible transition */
    FAULT_OVERCURRENT,          /* a phase current beyond i_trip */
    FAULT_CURRENT_SUM,          /* the three phase currents do not add up to zero */
    FAULT_OVERVOLTAGE,
    FAULT_UNDERVOLTAGE,
    FAULT_OVERSPEED,
    FAULT_CURRENT_OFFSET,    /* a current sensor's zero is out of range */
    FAULT_STALL,             /* full current, no motion */
    FAULT_LOOP_STOPPED,      /* the current loop's interrupt has gone silent, or comes too often */
    FAULT_WATCHDOG,          /* the last reset came from the watchdog */
    FAULT_EXCEPTION,         /* the last reset followed a processor fault; the console has the details */
    FAULT_CLOCK,             /* the clocks do not match the board header, or are not locked */
    FAULT_FABRIC,            /* the fabric does not carry the expected design */
    FAULT_LOCKUP,            /* the last reset came from a lock-up: a fault inside a fault handler */
    FAULT_STACK_GUARD,       /* the memory protection below the stack is not in effect */
    FAULT_WATCHDOG_OFF,      /* the watchdog is off, or does not reset */
    FAULT_PLL,               /* a PLL lost its lock while the program ran */
    FAULT_ECC,               /* an uncorrectable memory error while the program ran */
    FAULT_ENCODER_SLIP,      /* the counted angle is not the rotor's */
    FAULT_ENCODER_DEAD,      /* no counts although the rotor turns */
    FAULT_ENCODER_COUNTS,    /* the index does not come where the count says */
    FAULT_OPEN_PHASE,        /* a phase that should carry current does not */
    FAULT_SPEED_DEVIATION,   /* the speed has left its reference */
    FAULT_OVERTEMPERATURE,   /* the winding is beyond t_max */
    FAULT_INVERTER_OVERLOAD, /* I2t of the power stage */
    FAULT_VOLTAGE_LIMIT,     /* the bus voltage cannot drive the requested current */
    FAULT_LIMIT_CYCLE,       /* the speed loop oscillates by itself */
    FAULT_COMMAND_TIMEOUT,   /* no command for too long */
    FAULT_ROTOR_TURNING,     /* start: the rotor did not come to rest */
    FAULT_SENSOR_SIGN,       /* start: a current sensor counts backwards */
    FAULT_ENCODER_DIRECTION, /* start: encoder reversed or phase order wrong, which look alike */
    FAULT_POLE_PAIRS,        /* start: pole_pairs does not fit the encoder's counts */
    FAULT_ROTOR_BLOCKED,     /* start: the rotor does not follow the field */
    FAULT_LOAD_TOO_HIGH,     /* start: the load pulls the rotor out of the field */
    FAULT_GATES_OFF,         /* the fabric switched the gates off but latched no cause */
    FAULT_FOLLOWING_ERROR,   /* the shaft is not where it should be */
    FAULT_HOMING,            /* the search for index or hard stop found nothing */
    FAULT_LOCK_LOST,         /* without an encoder: the observer has lost the rotor */
    FAULT_OUT_OF_STEP,       /* without an encoder: the rotor has fallen out of step with the prescribed field */
    FAULT_SALIENCY,          /* start: the current does not show the rotor's position */
    FAULT_POLARITY,          /* start: cannot tell which end of the rotor's axis is north */
    FAULT_HALL_INVALID,      /* the Hall switches show a state that hall_states does not have */
    FAULT_HALL_SEQUENCE,     /* they skip a sector */
    FAULT_HALL_UNKNOWN,      /* `learn hall`: did not find their table */
    FAULT_SLOW_LOOP_STOPPED, /* the slow loop gave the fabric no proof of life; the fabric has switched off already */
    FAULT_THREAD_STOPPED,    /* the thread, likewise */
    FAULT_MASTER_LOST,       /* the master of the CAN bus no longer commands it */
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
    REACTION_CARRY, /* the same, without the encoder, if the observer sees the rotor: drive/failover.h; else stop or off */
    REACTION_COUNT
};

struct fault_class {
    uint8_t allowed; /* one bit per enum reaction */
    uint8_t initial; /* enum reaction */
    bool retry;      /* may be cleared and tried again without a person */
};

/* Never NULL; an unknown cause gets the class that allows only off. Any context. */
const struct fault_class *fault_class(enum fault cause);

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

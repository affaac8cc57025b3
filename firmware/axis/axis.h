/* SPDX-License-Identifier: MIT */
/*
 * One motor's drive: struct axis holds its whole state and is passed by pointer. Its state machine follows CiA 402
 * (IEC 61800-7-201) and is stepped once a millisecond.
 *
 * The thread posts each request as one word; the step carries it out. In "switched on" the drive runs its start sequence:
 * currents at rest, then the bridge on and the rotor pulled to a known angle.
 */
#ifndef FIRMWARE_AXIS_AXIS_H
#define FIRMWARE_AXIS_AXIS_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/fabric/fabric.h"
#include "firmware/axis/carry.h"
#include "firmware/axis/fault.h"
#include "firmware/axis/field_watch.h"
#include "firmware/axis/flying.h"
#include "firmware/axis/hall_watch.h"
#include "firmware/axis/handover.h"
#include "firmware/axis/injection_start.h"
#include "firmware/axis/keeping.h"
#include "firmware/axis/modes.h"
#include "firmware/axis/reaction.h"
#include "firmware/axis/sensorless.h"
#include "firmware/axis/start.h"
#include "firmware/axis/supervision.h"
#include "firmware/axis/switching.h"
#include "firmware/axis/thermal.h"
#include "firmware/commission/hall_learn.h"
#include "firmware/commission/identify.h"
#include "firmware/control/current_loop.h"
#include "firmware/control/hall.h"
#include "firmware/control/speed_loop.h"
#include "firmware/control/torque.h"
#include "firmware/settings/error.h"
#include "firmware/settings/params.h"
#include "firmware/settings/tuning.h"

enum axis_state {
    AXIS_NOT_READY,
    AXIS_SWITCH_ON_DISABLED,
    AXIS_READY,
    AXIS_SWITCHED_ON,
    AXIS_OPERATION_ENABLED,
    AXIS_QUICK_STOP,
    AXIS_FAULT_REACTION,
    AXIS_FAULT,
};

enum axis_request {
    AXIS_REQUEST_NONE,
    AXIS_REQUEST_ON,
    AXIS_REQUEST_OFF,
    AXIS_REQUEST_QUICK_STOP,
    AXIS_REQUEST_CLEAR,
    AXIS_REQUEST_IDENTIFY,
    AXIS_REQUEST_LEARN_HALL,
    AXIS_REQUEST_SOURCE, /* axis/handover.h */
};

#define AXIS_STANDSTILL_RPM_Q4 (30 * 16) /* below this the motor counts as at rest */

/*
 * Members that a step in operation reads lie within the first 4095 bytes, the reach of a load from one base register; the large
 * tables of `torque` and `motion` come after them.
 */
struct axis {
    struct current_loop loop; /* first: the interrupt addresses its members by offset */
    struct fabric *fabric;
    volatile uint32_t state; /* enum axis_state */
    volatile uint32_t mode;  /* enum axis_mode */
    volatile uint32_t time_ms;
    volatile uint32_t request;           /* enum axis_request: the thread writes it, the slow loop takes it */
    volatile int32_t torque_command_q15; /* for torque control */
    uint32_t stopping_ms;
    uint32_t lingering_ms;          /* the part of stopping_ms in which no limit held back braking */
    uint32_t heartbeat;             /* conversions at the last step */
    uint32_t paced_ms;              /* when the conversions per millisecond were last chosen */
    volatile uint32_t time_wraps;   /* of time_ms, once in 49.7 days */
    volatile uint32_t fabric_doubt; /* AXIS_FABRIC_DOUBTED until start-up trusts the fabric */
    volatile uint32_t command_ms;   /* when a host last addressed the drive */
    struct params params;           /* as set; take effect at the next switch-on */
    struct tuning tuning;           /* of the last switch-on */
    struct speed_loop speed;
    struct supervision supervision;
    struct thermal thermal;
    struct fault_record faults;
    struct carry carry;
    struct torque_control torque;
    struct motion motion;
    struct start start;
    struct sensorless sensorless;
    struct field_watch field_watch;
    struct flying flying;
    struct injection_start injection;
    struct reactions reactions;
    struct identify identify;
    struct keeping keeping;
    struct switching switching;
    struct hall hall;
    struct hall_watch hall_watch;
    struct hall_learn hall_learn;
    struct handover handover;
};

/* A single magic value: a stray write must not keep a fault from switching the bridge off. */
#define AXIS_FABRIC_DOUBTED 0xD0B7FABCu

/* What an operator sees, all taken at one instant. */
struct axis_status {
    uint32_t state; /* enum axis_state */
    uint32_t fault; /* enum fault */
    int32_t speed_rpm_q4, speed_ref_rpm_q4;
    int32_t i_d_q15, i_q_q15;
    int32_t i_d_ref_q15, i_q_ref_q15;
    int32_t vbus_q15;
    uint64_t up_ms;
    uint32_t mode; /* enum axis_mode */
    bool homed;
    int64_t position, target; /* counts; target and error only in modes with a position reference */
    int32_t error_counts;
};

/* True if no fabric register may be touched. Any context. */
static inline bool axis_fabric_doubted(const struct axis *a)
{
    return a->fabric_doubt == AXIS_FABRIC_DOUBTED;
}

/* Puts the axis into its first state: initial parameters, fabric in doubt. Touches no register. Thread, once. */
void axis_init(struct axis *a, struct fabric *fabric);

/* Sets where temperatures are kept across a reset, and takes up those kept there. Thread, once, after axis_init(). */
void axis_remember_heat(struct axis *a, struct thermal_memory *memory);

/*
 * Leaves "not ready": starts PWM, encoder and ADC, bridge off. `boot_fault` is what start-up found. If it puts the fabric in
 * doubt, the axis stays in "fault" and neither reads nor writes a fabric register until a reset; the gates are off because
 * reset leaves them off. Thread, once.
 */
void axis_start(struct axis *a, enum fault boot_fault);

/* One step. Slow loop. */
void axis_step(struct axis *a);

/* Switches off, and latches the cause with a snapshot if it is the first. Any context. See fault.h. */
void axis_raise(struct axis *a, enum fault cause);

/* Latches without switching off; returns true if it was the first. For axis_raise() and axis/reaction.c. Any context. */
bool fault_latch(struct axis *a, enum fault cause, int32_t detail_0, int32_t detail_1);
/* The operator, or a retry, has cleared it: the bridge may be enabled again. Slow loop. */
void fault_forget(struct axis *a);
/* axis_raise() with the cause's details: fault_record.detail. */
void axis_raise_with(struct axis *a, enum fault cause, int32_t detail_0, int32_t detail_1);

/* The current loop's interrupt exits here when a sample has a fault: finds the cause. ISR. */
void axis_sample_fault(struct axis *a);

/*
 * Requests: thread. Each is checked here against the state that earlier requests have led to, and the next step carries it out.
 * A refused request changes nothing. A request in the same millisecond as the one before waits until the slow loop has taken
 * that one; if the slow loop is dead it gives up after a few milliseconds (ERROR_BUSY), and switching off closes the gates by
 * itself.
 */
struct outcome axis_switch_on(struct axis *a); /* axis_prepare() completes it */
struct outcome axis_switch_off(struct axis *a);
struct outcome axis_identify(struct axis *a);     /* measures the motor, then off; `off` ends it sooner */
struct outcome axis_identify_use(struct axis *a); /* turns results into parameters; value: how many changed */
struct outcome axis_quick_stop(struct axis *a);   /* before operation, where nothing can brake, it switches off */
struct outcome axis_clear_fault(struct axis *a);
void axis_withdraw(struct axis *a); /* the operator no longer wants operation: nothing switches on by itself any more */
struct outcome axis_clear_latches(struct axis *a); /* the same, not by a person: the retry count goes on */
struct outcome axis_command_speed(struct axis *a, int32_t rpm);
struct outcome axis_command_current(struct axis *a, int32_t milliamp);
struct outcome axis_command_position(struct axis *a, int32_t counts,
                                     bool relative); /* to the last target, or to the shaft */
struct outcome axis_command_home(struct axis *a, enum homing_method method);
struct outcome axis_command_cyclic_position(struct axis *a, int32_t counts);
struct outcome axis_command_cyclic_speed(struct axis *a, int32_t rpm);
struct outcome axis_command_cyclic_current(struct axis *a, int32_t milliamp);
struct outcome axis_learn_cogging(struct axis *a); /* takes two turns and a bit at learn_rpm */
struct outcome axis_learn_hall(struct axis *a); /* takes some ten seconds, then off; the table is in the parameters */
/* Changes the source of the angle, enum param_angle; axis_prepare() completes it, axis.handover.outcome. */
struct outcome axis_change_source(struct axis *a, uint32_t target);
struct outcome axis_set_zero(struct axis *a); /* the shaft's present position becomes 0, on or off */

/*
 * Does one part of the work of switching on (switching.h, row torque_build.part of the benchmarks); returns true if there is
 * more. The last part makes the request, unless something has come up that forbids it: axis.switching.outcome tells. Does
 * nothing if nothing is under way. Also serves a hand-over from one source of the angle to another (handover.h). Thread.
 */
bool axis_prepare(struct axis *a);

/* A host has addressed the drive. Thread. */
static inline void axis_hear(struct axis *a)
{
    a->command_ms = a->time_ms;
}

/* True if parameters may change now: bridge off, no start under way. Thread; waits as requests do. */
bool axis_is_off(const struct axis *a);

/* Thread. Holds off the slow loop for some 100 cycles, the current loop not at all. */
struct axis_status axis_status(const struct axis *a);

/* Milliseconds since the start, without wrapping. Any context. */
uint64_t axis_up_ms(const struct axis *a);

#endif

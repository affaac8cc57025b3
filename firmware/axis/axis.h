/* SPDX-License-Identifier: MIT */
/*
 * One motor: struct axis holds the whole state of its drive and is passed by pointer. It is data only: the rooms above control
 * share it, and each of its parts is declared, and explained, by the room that writes it.
 */
#ifndef FIRMWARE_AXIS_AXIS_H
#define FIRMWARE_AXIS_AXIS_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/fabric/fabric.h"
#include "firmware/commission/identify.h"
#include "firmware/commission/learn.h"
#include "firmware/control/current_loop.h"
#include "firmware/control/hall.h"
#include "firmware/control/speed_loop.h"
#include "firmware/control/torque.h"
#include "firmware/drive/failover.h"
#include "firmware/drive/handover.h"
#include "firmware/drive/modes.h"
#include "firmware/drive/nvm.h"
#include "firmware/drive/owner.h"
#include "firmware/drive/reaction.h"
#include "firmware/drive/retry.h"
#include "firmware/drive/start.h"
#include "firmware/drive/switching.h"
#include "firmware/fault/fault.h"
#include "firmware/monitor/lock_watch.h"
#include "firmware/monitor/supervision.h"
#include "firmware/monitor/thermal.h"
#include "firmware/settings/error.h"
#include "firmware/settings/params.h"
#include "firmware/settings/tuning.h"
#include "firmware/source/flying.h"
#include "firmware/source/injection_start.h"
#include "firmware/source/sensorless.h"

/* How many motors the image drives: make AXES=2. */
#ifndef AXIS_COUNT
#define AXIS_COUNT 1u
#endif

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
    AXIS_REQUEST_SOURCE, /* drive/handover.h */
};

/* Of an axis' address these bits are 0: the interrupt's assembly stores it to ADC.STATUS, where they would clear something. */
#ifdef __arm__
#define AXIS_ALIGNMENT 512u
#else
#define AXIS_ALIGNMENT 8u
#endif

#define AXIS_STANDSTILL_RPM_Q4 (30 * 16) /* below this the motor counts as at rest */

/*
 * What the interrupt reads lies within the first 4095 bytes, the reach of a load from one base register: `loop` and `hall`.
 * Behind these the order leaves few gaps: one word too many is AXIS_ALIGNMENT bytes for each axis.
 */
struct axis {
    _Alignas(AXIS_ALIGNMENT) struct current_loop loop; /* first: the interrupt addresses its members by offset */
    struct fabric *fabric;
    struct axis *beside; /* the other motor of this core, or NULL: both need its thread, its memory, its time */
    uint32_t carrier_ahead_counts; /* of the other motor's; 0: the carrier runs by itself */
    volatile uint32_t state;       /* enum axis_state */
    volatile uint32_t mode;        /* enum axis_mode */
    volatile uint32_t time_ms;
    volatile uint32_t request;           /* enum axis_request: the thread writes it, the slow loop takes it */
    struct set_point set_point;          /* the thread writes it, the slow loop takes it */
    volatile int32_t torque_command_q15; /* for torque control */
    uint32_t stopping_ms;
    uint32_t unlimited_braking_ms;  /* the part of stopping_ms in which no limit held back braking */
    uint32_t heartbeat;             /* conversions at the last step */
    uint32_t pace_chosen_ms;        /* when the conversions per millisecond were last chosen */
    uint32_t beside_identified_ms;  /* when the other axis last identified */
    volatile uint32_t time_wraps;   /* of time_ms, once in 49.7 days */
    volatile uint32_t fabric_doubt; /* AXIS_FABRIC_DOUBTED until start-up trusts the fabric */
    volatile uint32_t thread_ms;    /* when the thread last made progress; 0: it has not begun */
    volatile uint32_t command_ms;   /* when the owner last addressed the drive; anybody, while it has none */
    volatile uint32_t master_lost;  /* why the master of the CAN bus is missing, 0: it is not */
    struct ownership owner;
    struct params params; /* as set; take effect at the next switch-on */
    struct tuning tuning; /* of the last switch-on */
    struct speed_loop speed;
    struct hall hall;
    struct supervision supervision;
    struct fault_record faults;
    struct fault_reports reports;
    struct failover failover;
    struct torque_control torque;
    struct thermal thermal;
    struct motion motion;
    struct start start;
    struct sensorless sensorless;
    struct field_watch field_watch;
    struct flying flying;
    struct hall_watch hall_watch;
    struct injection_start injection;
    struct reactions reactions;
    struct retry retry;
    struct identify identify;
    struct nvm_cogging nvm_cogging;
    bool
        nvm_afresh; /* `defaults` was the last: a save carries nothing over that this image does not know. The thread's */
    struct switching switching;
    struct lock_watch lock_watch;
    struct hall_learn hall_learn;
    struct handover handover;
};

/* A single magic value: a stray write must not keep a fault from switching the bridge off. */
#define AXIS_FABRIC_DOUBTED 0xD0B7FABCu

/* True if no fabric register may be touched. Any context. */
static inline bool axis_fabric_doubted(const struct axis *a)
{
    return a->fabric_doubt == AXIS_FABRIC_DOUBTED;
}

/*
 * 1, or -1 where the operator's forward is the machine's backward. The drive's inside knows the machine's alone: set-points are
 * turned as they come in, speeds, positions and torques as they are shown. It changes only while the bridge is off.
 */
static inline int32_t axis_forward(const struct axis *a)
{
    return a->params.direction != 0 ? -1 : 1;
}

/* Milliseconds since the start, without wrapping. Any context. */
uint64_t axis_up_ms(const struct axis *a);

#endif

/* SPDX-License-Identifier: MIT */
/*
 * One motor: struct axis holds the whole state of its drive and is passed by pointer. It is data only: the rooms above control
 * share it. Each part is declared and explained by the room that writes it.
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

/* The low bits of an axis' address must be 0: the interrupt's assembly writes it to ADC.STATUS, where a 1 clears a flag. */
#ifdef __arm__
#define AXIS_ALIGNMENT 512u
#else
#define AXIS_ALIGNMENT 8u
#endif

#define AXIS_STANDSTILL_RPM_Q4 (30 * 16) /* below this the motor counts as at rest */

/*
 * What the interrupt reads lies within the first 4095 bytes, the reach of a load from one base register: `loop` and `hall`. The
 * rest is ordered to avoid padding: one word too many costs AXIS_ALIGNMENT bytes for each axis.
 */
struct axis {
    _Alignas(AXIS_ALIGNMENT) struct current_loop loop; /* first: the interrupt addresses its members by offset */
    struct fabric *fabric;
    struct axis *other_axis;       /* the other motor of this core, or NULL: they share thread, memory and time */
    uint32_t carrier_ahead_counts; /* phase lead over the other motor's carrier; 0: it runs freely */
    volatile uint32_t state;       /* enum axis_state */
    volatile uint32_t mode;        /* enum axis_mode */
    volatile uint32_t time_ms;
    volatile uint32_t request;           /* enum axis_request: mailbox from the thread to the slow loop */
    struct set_point set_point;          /* mailbox from the thread to the slow loop */
    volatile int32_t torque_command_q15; /* for torque control */
    uint32_t stopping_ms;
    uint32_t unlimited_braking_ms;      /* the part of stopping_ms in which no limit reduced the braking torque */
    uint32_t heartbeat;                 /* conversions at the last step */
    uint32_t rate_chosen_ms;            /* when the conversions per millisecond were last chosen */
    uint32_t other_identified_ms;       /* when the other axis last identified */
    volatile uint32_t time_wraps;       /* overflows of time_ms, one in 49.7 days */
    volatile uint32_t fabric_untrusted; /* AXIS_FABRIC_UNTRUSTED until start-up trusts the fabric */
    volatile uint32_t thread_ms;        /* when the thread last ran; 0: not yet */
    volatile uint32_t command_ms;       /* when the owner last sent a message, or anybody while there is no owner */
    volatile uint32_t master_lost;      /* why the CAN master counts as lost; 0: it does not */
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
    bool nvm_from_defaults; /* since `defaults` a save drops stored values unknown to this image. The thread's */
    struct switching switching;
    struct lock_watch lock_watch;
    struct hall_learn hall_learn;
    struct handover handover;
};

/* A single magic value: a stray write must not keep a fault from switching the bridge off. */
#define AXIS_FABRIC_UNTRUSTED 0xD0B7FABCu

/* True if no fabric register may be touched. Any context. */
static inline bool axis_fabric_is_untrusted(const struct axis *a)
{
    return a->fabric_untrusted == AXIS_FABRIC_UNTRUSTED;
}

/*
 * 1, or -1 if the operator's positive direction is the machine's negative one (parameter direction). Inside the drive
 * everything is in the machine's direction: set-points are converted on input; speeds, positions and torques on output. It
 * changes only while the bridge is off.
 */
static inline int32_t axis_forward(const struct axis *a)
{
    return a->params.direction != 0 ? -1 : 1;
}

/* Milliseconds since the start, without wrapping. Any context. */
uint64_t axis_up_ms(const struct axis *a);

#endif

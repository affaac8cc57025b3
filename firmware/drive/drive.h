/* SPDX-License-Identifier: MIT */
/*
 * One motor's drive, as the rest of the program sees it. Its state machine follows CiA 402 (IEC 61800-7-201) and is stepped
 * once a millisecond. The thread posts each request as one word; the step carries it out. In "switched on" the drive runs its
 * start sequence: currents at rest, then the bridge on and the rotor pulled to a known angle.
 */
#ifndef FIRMWARE_DRIVE_DRIVE_H
#define FIRMWARE_DRIVE_DRIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/axis/axis.h"
#include "firmware/settings/error.h"

/* The status for the operator, all of one instant. */
struct drive_status {
    uint32_t state; /* enum axis_state */
    uint32_t fault; /* enum fault */
    int32_t speed_rpm_q4, speed_ref_rpm_q4;
    int32_t i_d_q15, i_q_q15;
    int32_t i_d_ref_q15, i_q_ref_q15;
    int32_t vbus_q15;
    uint64_t up_ms;
    uint32_t mode; /* enum axis_mode */
    bool homed;
    int32_t position, target; /* counts, lower 32 bits; target and error only in modes with a position reference */
    int32_t error_counts;
};

/* Initial state and parameters; the fabric is not trusted yet. Accesses no register. Thread, once. */
void drive_init(struct axis *a, struct fabric *fabric);

/*
 * Links two axes whose fabrics share a clock. `follower`'s carrier leads the other's by a quarter of a period, so that their
 * samples, one or two a period, never coincide. Thread, once, between drive_init() and drive_start() of both.
 */
void drive_link(struct axis *a, struct axis *follower);

/* Sets where temperatures are kept across a reset, and restores them from there. Thread, once, after drive_init(). */
void drive_restore_temperatures(struct axis *a, struct thermal_memory *memory);

/*
 * Leaves "not ready": starts PWM, encoder and ADC, bridge off. `boot_fault` is what start-up found. If it means that the fabric
 * cannot be trusted, the axis stays in "fault" and neither reads nor writes a fabric register until a reset; the gates are off
 * because reset leaves them off. Thread, once.
 */
void drive_start(struct axis *a, enum fault boot_fault);

/* One step. Slow loop. */
void drive_step(struct axis *a);

/* The current loop's interrupt exits here when a sample has a fault: finds the cause. ISR. */
void drive_sample_fault(struct axis *a);

/*
 * Requests: thread. Each is checked here against the present state; the next step of the slow loop executes it. A refused
 * request changes nothing. A request in the same millisecond as the one before waits until the slow loop has taken that one; if
 * the slow loop is dead it gives up after a few milliseconds (ERROR_BUSY), and switching off closes the gates by itself.
 */
struct outcome drive_switch_on(struct axis *a); /* drive_prepare() completes it */
struct outcome drive_switch_off(struct axis *a);
struct outcome drive_identify(struct axis *a);     /* measures the motor, then switches off; `off` aborts */
struct outcome drive_identify_use(struct axis *a); /* copies the results into the parameters; value: how many changed */
struct outcome drive_quick_stop(struct axis *a);   /* before operation is enabled it switches off */
struct outcome drive_clear_fault(struct axis *a);
struct outcome drive_forget(struct axis *a); /* discards the encoder's offset, while off: the next start aligns */
void drive_withdraw(struct axis *a);         /* the operator no longer wants operation: no automatic restart */
struct outcome drive_clear_latches(struct axis *a); /* the same for a retry: its count is kept */
struct outcome drive_command_speed(struct axis *a, int32_t rpm);
struct outcome drive_command_current(struct axis *a, int32_t milliamp);
struct outcome drive_command_position(struct axis *a, int32_t counts,
                                      bool relative); /* to the last target, else to the actual position */
struct outcome drive_command_home(struct axis *a, enum homing_method method);
struct outcome drive_command_cyclic_position(struct axis *a, int32_t counts);
struct outcome drive_command_cyclic_speed(struct axis *a, int32_t rpm);
struct outcome drive_command_cyclic_current(struct axis *a, int32_t milliamp);
struct outcome drive_learn_cogging(struct axis *a); /* takes a little more than two turns at learn_rpm */
/* takes about ten seconds, then off; the result is in the parameters */
struct outcome drive_learn_hall(struct axis *a);
/* Changes the source of the angle, enum param_angle; drive_prepare() completes it; result in axis.handover.outcome. */
struct outcome drive_change_source(struct axis *a, uint32_t target);
struct outcome drive_set_zero(struct axis *a); /* the actual position becomes 0, on or off */

/*
 * Does one part of the work of switching on (switching.h, row torque_build.part of the benchmarks); returns true if there is
 * more. The last part makes the request, unless something now forbids it; the result is in axis.switching.outcome. No effect if
 * nothing is in progress. Also serves a hand-over from one source of the angle to another (handover.h). Thread.
 */
bool drive_prepare(struct axis *a);

/* True while starting, operating or stopping: the bridge is on, or about to be. Any context. */
bool drive_is_on(const struct axis *a);

/* True if parameters may change now: bridge off, no start under way. Thread; may wait like a request. */
bool drive_is_off(const struct axis *a);

/* Thread. Masks the slow loop for some 100 cycles, the current loop not at all. */
struct drive_status drive_status(const struct axis *a);

/* The drive's raw values in thousandths of their units, for console and bus. Thread. */
static inline int32_t quantity_milli_rpm(int32_t rpm_q4)
{
    return (int32_t)((int64_t)rpm_q4 * 1000 / 16);
}

static inline int32_t quantity_milliamp(const struct axis *a, int32_t q15)
{
    return tuning_milli_from_q15(q15, a->params.i_range_ma);
}

static inline int32_t quantity_millivolt(const struct axis *a, int32_t q15)
{
    return tuning_milli_from_q15(q15, a->params.v_range_mv);
}

#endif

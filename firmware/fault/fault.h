/* SPDX-License-Identifier: MIT */
/*
 * Faults: causes (fault/faults.h has the list), and the latch. fault_raise() shuts the gates, then latches the first cause with
 * a snapshot of the drive at that instant. The current loop's interrupt may preempt a call from a lower level; then the
 * interrupt's cause stays.
 */
#ifndef FIRMWARE_FAULT_FAULT_H
#define FIRMWARE_FAULT_FAULT_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/fault/faults.h"

struct axis;

#define FAULT_NUMBER(number, name, ...) FAULT_##name = (number),

enum fault { FAULT_NONE, FAULTS(FAULT_NUMBER) FAULT_COUNT };

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

/* Each fault's initial reaction. Any context. */
void fault_initial_choices(uint8_t choice[FAULT_COUNT]);

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

/* The latched cause is known better. Slow loop. */
void fault_turns_out(struct axis *a, enum fault cause);

/* The operator, or a retry, has cleared it: the bridge may be enabled again. Slow loop. */
void fault_forget(struct axis *a);

/* ==== reporting ==== */

/*
 * What the slow loop finds wrong. Modes, sources and monitors only report: they change nothing, and know no state and no
 * reaction. drive/reaction.h takes the reports in their order at the end of the same step.
 */

#define FAULT_REPORTS_MOST 12u /* a step makes fewer: each monitor has its turns */
#define FAULT_WORDS        ((FAULT_COUNT + 31u) / 32u)

struct fault_report {
    enum fault cause;
    int32_t detail[2]; /* fault_record.detail */
};

struct fault_reports {
    uint32_t count;
    struct fault_report report[FAULT_REPORTS_MOST];
    volatile uint32_t warned[FAULT_WORDS]; /* one bit per fault that was only a warning, since `on` */
};

/* One for which there is no room is raised. Slow loop. */
void fault_report(struct axis *a, enum fault cause, int32_t detail_0, int32_t detail_1);

/* Only warns, whatever reaction is chosen. Slow loop. */
void fault_warn(struct axis *a, enum fault cause);

/* Warns as long as it lasts, off or on. Slow loop, again and again. */
void fault_warn_while(struct axis *a, enum fault cause, bool lasts);

/* True if a fault was a warning since `on`. Any context. */
bool fault_warned(const struct fault_reports *r, enum fault cause);

/* True if any was. Any context. */
bool fault_warns(const struct fault_reports *r);

/* Forgets the warnings. Slow loop, at `on`. */
void fault_forget_warnings(struct fault_reports *r);

#endif

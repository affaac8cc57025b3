/* SPDX-License-Identifier: MIT */
#include "firmware/operate/cia402.h"

#include <stddef.h>

#include "lib/q15.h"

/* ---- modes of operation ---- */

struct cia402_mode_row {
    int8_t mode;                                             /* enum cia402_mode; below 0: shown only */
    uint8_t axis_mode;                                       /* enum axis_mode */
    enum { ON_EDGE, RPM, COUNTS, TORQUE } target;            /* its set-point; pp and hm wait for an edge of bit 4 */
    struct outcome (*demand)(struct axis *a, int32_t value); /* called when mode or target is written */
};

static const struct cia402_mode_row cia402_modes[] = {
    {CIA402_PV, AXIS_MODE_SPEED, RPM, drive_command_speed},
    {CIA402_TQ, AXIS_MODE_TORQUE, TORQUE, drive_command_current},
    {CIA402_PP, AXIS_MODE_POSITION, ON_EDGE, NULL},
    {CIA402_HM, AXIS_MODE_HOMING, ON_EDGE, NULL},
    {CIA402_CSP, AXIS_MODE_CYCLIC_POSITION, COUNTS, drive_command_cyclic_position},
    {CIA402_CSV, AXIS_MODE_CYCLIC_SPEED, RPM, drive_command_cyclic_speed},
    {CIA402_CST, AXIS_MODE_CYCLIC_TORQUE, TORQUE, drive_command_cyclic_current},
    {-1, AXIS_MODE_LEARNING, ON_EDGE, NULL},
};

#define MODES (sizeof cia402_modes / sizeof cia402_modes[0])

/* The row of a mode that can be requested, or NULL. */
static const struct cia402_mode_row *find_mode(int32_t mode)
{
    for (size_t n = 0; n < MODES; n++) {
        if (mode > 0 && cia402_modes[n].mode == mode) {
            return &cia402_modes[n];
        }
    }
    return NULL;
}

uint32_t cia402_supported_modes(const struct axis *a)
{
    uint32_t bits = 0;
    for (size_t n = 0; n < MODES; n++) {
        if (cia402_modes[n].mode > 0 && modes_available(a, cia402_modes[n].axis_mode).error == ERROR_NONE) {
            bits |= 1u << (cia402_modes[n].mode - 1);
        }
    }
    return bits;
}

/* ---- set-points accepted ---- */

void cia402_init(struct cia402 *c, enum owner who)
{
    *c = (struct cia402){.setpoints = {.mode = CIA402_PV, .homing_method = CIA402_HOME_INDEX},
                         .who = who,
                         .refusal = OUTCOME_OK,
                         .exponent = -3};
}

static int32_t milliamp_of(int32_t torque_pm, const struct params *p)
{
    return (int32_t)((int64_t)torque_pm * p->i_rated_ma / 1000);
}

static bool within_limit(int32_t x, int32_t limit)
{
    return x >= -limit && x <= limit;
}

static bool known_homing(int32_t method)
{
    return method == CIA402_HOME_INDEX || method == CIA402_HOME_BLOCK || cia402_homes_here(method);
}

bool cia402_allows(const struct cia402_setpoints *s, const struct params *p)
{
    return find_mode(s->mode) != NULL && known_homing(s->homing_method) &&
           within_limit(s->target_rpm, p->speed_max_rpm) &&
           within_limit(milliamp_of(s->target_torque_pm, p), p->i_max_ma);
}

void cia402_accept(struct cia402 *c, const struct cia402_setpoints *s, bool word, bool target)
{
    c->setpoints = *s;
    c->word_due = c->word_due || word;
    c->target_due = c->target_due || target;
}

/* ---- the state machine ---- */

/* Or will be within a millisecond: a fault is latched, and no controlled stop is under way. */
static bool axis_is_faulty(const struct axis *a)
{
    return a->state == AXIS_FAULT || a->state == AXIS_FAULT_REACTION ||
           (a->faults.cause != FAULT_NONE && !a->reactions.stopping);
}

/* This bus commands the axis, and it is on, or will be. */
static bool owns_axis(const struct cia402 *c, const struct axis *a)
{
    return a->owner.who == (uint32_t)c->who && !owner_axis_is_off(a);
}

static enum cia402_state state_of(const struct cia402 *c, const struct axis *a)
{
    if (axis_is_faulty(a)) {
        return CIA402_FAULT;
    }
    if (a->state == AXIS_QUICK_STOP) {
        return CIA402_QUICK_STOP; /* whichever line commands; DISABLED follows */
    }
    return owns_axis(c, a) ? CIA402_ENABLED : c->stage;
}

static void switch_axis_off(struct cia402 *c, struct axis *a)
{
    c->refusal = OUTCOME_OK;
    if (!owner_axis_is_off(a)) {
        c->refusal = drive_switch_off(a);
        owner_give_up(a);
    }
}

static void quick_stop(struct cia402 *c, struct axis *a)
{
    if (a->state == AXIS_OPERATION_ENABLED) {
        c->refusal = drive_quick_stop(a);
    } else if (a->state != AXIS_QUICK_STOP) { /* which continues */
        switch_axis_off(c, a);
    }
}

static void enable(struct cia402 *c, struct axis *a)
{
    c->refusal = owner_allows(a, c->who);
    if (c->refusal.error == ERROR_NONE) {
        c->refusal = drive_switch_on(a);
    }
    if (c->refusal.error == ERROR_NONE) {
        owner_take(a, c->who);
        c->stage = CIA402_DISABLED; /* the state it ends in by itself */
        c->authority = AUTHORITY_STARTING;
    }
}

static void reset_fault(struct cia402 *c, struct axis *a)
{
    owner_stopped(a, c->who);
    c->refusal = drive_clear_fault(a);
}

static void accept(struct cia402 *c, struct axis *a)
{
    (void)a;
    c->refusal = OUTCOME_OK;
}

enum command { SHUT_DOWN, SWITCH_ON, ENABLE, DISABLE_VOLTAGE, QUICK_STOP, RESET_FAULT };

#define IN(state) (1u << CIA402_##state)
#define OFF       (IN(DISABLED) | IN(READY) | IN(SWITCHED_ON))

/*
 * IEC 61800-7-201, with its transition numbers; 0, 1, 13, 14 are the axis' own, 16 is not supported. Commands that stop act in
 * each state, whichever line commands.
 */
static const struct transition {
    uint8_t from;    /* a bit for each enum cia402_state */
    uint8_t command; /* enum command */
    uint8_t to;      /* the stage; until the axis is there, its own state is shown */
    void (*act)(struct cia402 *c, struct axis *a);
} cia402_transitions[] = {
    {IN(DISABLED) | IN(READY) | IN(SWITCHED_ON), SHUT_DOWN, CIA402_READY, accept}, /* 2, 6 */
    {IN(READY) | IN(SWITCHED_ON), SWITCH_ON, CIA402_SWITCHED_ON, accept},          /* 3 */
    {IN(READY) | IN(SWITCHED_ON), ENABLE, CIA402_SWITCHED_ON, enable},             /* 3, 4; stays there if refused */
    {IN(ENABLED), SWITCH_ON, CIA402_SWITCHED_ON, switch_axis_off},                 /* 5 */
    {IN(ENABLED), SHUT_DOWN, CIA402_READY, switch_axis_off},                       /* 8 */
    {OFF | IN(ENABLED) | IN(QUICK_STOP), DISABLE_VOLTAGE, CIA402_DISABLED, switch_axis_off}, /* 7, 9, 10, 12 */
    {OFF | IN(ENABLED) | IN(QUICK_STOP), QUICK_STOP, CIA402_DISABLED, quick_stop},           /* 7, 10, 11 */
    {IN(FAULT), RESET_FAULT, CIA402_DISABLED, reset_fault},                                  /* 15 */
};

static enum command command_of(uint32_t word)
{
    return (word & CIA402_VOLTAGE) == 0u         ? DISABLE_VOLTAGE
           : (word & CIA402_NO_QUICK_STOP) == 0u ? QUICK_STOP
           : (word & CIA402_SWITCH_ON) == 0u     ? SHUT_DOWN
           : (word & CIA402_ENABLE) == 0u        ? SWITCH_ON
                                                 : ENABLE;
}

bool cia402_stops(uint32_t word)
{
    const enum command command = command_of(word);
    return command == DISABLE_VOLTAGE || command == QUICK_STOP;
}

bool cia402_enables(uint32_t word)
{
    return command_of(word) == ENABLE;
}

static void change_state(struct cia402 *c, struct axis *a, enum command command)
{
    const enum cia402_state state = state_of(c, a);
    for (size_t n = 0; n < sizeof cia402_transitions / sizeof cia402_transitions[0]; n++) {
        const struct transition *const t = &cia402_transitions[n];
        if ((t->from >> state & 1u) != 0u && t->command == (uint8_t)command) {
            c->stage = (enum cia402_state)t->to;
            t->act(c, a);
            return;
        }
    }
}

bool cia402_change_source(struct cia402 *c, struct axis *a, uint32_t source)
{
    c->refusal = drive_change_source(a, source);
    c->source_due = c->refusal.error == ERROR_NONE;
    return c->source_due;
}

void cia402_take_over(struct cia402 *c, struct axis *a)
{
    const struct drive_status now = drive_status(a);
    const int32_t mode = cia402_mode_display(c, &now);
    const bool runs = now.state == AXIS_OPERATION_ENABLED && now.mode == AXIS_MODE_SPEED;
    c->setpoints.mode = find_mode(mode) != NULL ? mode : c->setpoints.mode;
    c->setpoints.target_rpm = runs ? axis_forward(a) * (a->speed.target_rpm_q16 / 65536) : 0;
    c->setpoints.target_torque_pm = 0; /* an old target must not take effect at the next enabling */
    owner_take_over(a, c->who);
}

/* What this bus had started has ended: by itself, because it could not start, or by another line. */
static void handle_end(struct cia402 *c, const struct axis *a)
{
    if (c->authority == AUTHORITY_STARTING && a->switching.outcome.error != ERROR_NONE && owner_axis_is_off(a)) {
        c->refusal = a->switching.outcome;
    }
    if (a->owner.stopped_by != OWNER_NONE && a->owner.stopped_by != (uint32_t)c->who) {
        c->refusal = (struct outcome){ERROR_STOPPED, (int32_t)a->owner.stopped_by};
    } else if (owner_allows(a, c->who).error != ERROR_NONE) { /* taken over */
        c->refusal = owner_allows(a, c->who);
    }
    c->authority = AUTHORITY_NONE;
}

/* After any end that this bus did not command, the whole sequence starts over. */
static void follow_axis(struct cia402 *c, const struct axis *a)
{
    if (c->source_due && !a->handover.under_way) {
        c->source_due = false;
        c->refusal = a->handover.outcome;
    }
    bool faulty = axis_is_faulty(a);
    if (faulty ||
        a->faults.cause == FAULT_NONE) { /* else a controlled stop is under way, and the state is not FAULT yet */
        faulty = faulty || c->faults != a->faults.count; /* or cleared since, at the console */
        c->faults = a->faults.count;
    }
    const bool ends = faulty || a->state == AXIS_QUICK_STOP || owner_allows(a, c->who).error != ERROR_NONE;
    c->stage = ends ? CIA402_DISABLED : c->stage; /* a refused control word must not take effect later */
    c->target_due = c->target_due && !faulty && owns_axis(c, a);
    if (c->authority != AUTHORITY_NONE && !owns_axis(c, a)) {
        handle_end(c, a);
    } else if (owns_axis(c, a) && (faulty || c->authority == AUTHORITY_NONE)) {
        c->authority = AUTHORITY_RETURNED; /* by a restart, or a take-over */
    }
}

/* ---- set-points ---- */

/* Of a mode that acts immediately; a mode that waits for an edge keeps a held position, and else brakes to rest. */
static __attribute__((noinline)) void apply_target(struct cia402 *c, struct axis *a)
{
    const struct cia402_setpoints *const s = &c->setpoints;
    const struct cia402_mode_row *const row = find_mode(s->mode);
    if (row == NULL) {
        return;
    }
    if (row->demand == NULL) {
        const bool holds = c->mode_before == s->mode || a->mode == AXIS_MODE_POSITION || a->mode == row->axis_mode;
        c->refusal = holds ? OUTCOME_OK : drive_command_speed(a, 0);
    } else {
        c->refusal = row->demand(a, row->target == RPM      ? s->target_rpm
                                    : row->target == COUNTS ? s->target_counts
                                                            : milliamp_of(s->target_torque_pm, &a->params));
    }
}

static struct outcome start_homing(int32_t method, struct axis *a)
{
    if (cia402_homes_here(method)) {
        return drive_set_zero(a);
    }
    return drive_command_home(a, method == CIA402_HOME_INDEX ? HOMING_INDEX : HOMING_BLOCK);
}

/* At a rising edge of bit 4. */
static void start_motion(struct cia402 *c, struct axis *a)
{
    const struct cia402_setpoints *const s = &c->setpoints;
    if (s->mode == CIA402_PP) {
        c->refusal = drive_command_position(a, s->target_counts, (s->control_word & CIA402_RELATIVE) != 0u);
    } else if (s->mode == CIA402_HM) {
        c->refusal = start_homing(s->homing_method, a);
    }
}

static void operate(struct cia402 *c, struct axis *a, uint32_t rising)
{
    const uint32_t word = c->setpoints.control_word;
    if ((rising & CIA402_HALT) != 0u) {
        c->refusal = drive_command_speed(a, 0);
    } else if ((word & CIA402_HALT) != 0u) {
        return;
    } else if ((rising & CIA402_NEW_SET_POINT) != 0u) {
        start_motion(c, a);
    } else if (c->target_due) {
        apply_target(c, a);
    }
    c->mode_before = c->setpoints.mode;
    c->target_due = false;
}

/* Carries out a new control word's change of state; returns its rising edges. */
static uint32_t take_word(struct cia402 *c, struct axis *a)
{
    const uint32_t word = c->setpoints.control_word;
    const uint32_t rising = word & ~c->word_before;
    const bool withdraws = cia402_stops(word) || (!cia402_enables(word) && a->owner.who == (uint32_t)c->who);
    c->target_due = c->target_due || (c->word_before & ~word & CIA402_HALT) != 0u;
    c->word_before = word;
    c->word_due = false;
    if (withdraws) {
        owner_stopped(a, c->who);
        drive_withdraw(a); /* level, not edge: also cancels a pending switch-on or restart */
    }
    change_state(c, a, command_of(word));
    if ((rising & CIA402_FAULT_RESET) != 0u) {
        change_state(c, a, RESET_FAULT);
    }
    if (withdraws && !owns_axis(c, a)) {
        c->authority = AUTHORITY_NONE; /* as commanded */
    }
    return rising;
}

/* Continuous modes begin with the present target; csp, and an axis that this bus did not enable, wait for a new one. */
static void begin_operating(struct cia402 *c)
{
    c->target_due = c->authority == AUTHORITY_STARTING ? c->setpoints.mode != CIA402_CSP : c->target_due;
    c->authority = AUTHORITY_OPERATING;
}

void cia402_poll(struct cia402 *c, struct axis *a)
{
    follow_axis(c, a);
    uint32_t rising = c->word_due ? take_word(c, a) : 0u;
    if (!owns_axis(c, a) || a->state != AXIS_OPERATION_ENABLED) {
        return;
    }
    if (c->authority != AUTHORITY_OPERATING) {
        begin_operating(c);
        rising = c->setpoints.control_word & CIA402_HALT;
    }
    if (c->target_due || rising != 0u) {
        operate(c, a, rising);
    }
}

/* ---- mode display ---- */

int32_t cia402_mode_display(const struct cia402 *c, const struct drive_status *now)
{
    const struct cia402_mode_row *const asked = find_mode(c->setpoints.mode);
    const bool waits = c->authority == AUTHORITY_OPERATING && asked != NULL && asked->demand == NULL &&
                       (now->mode == AXIS_MODE_SPEED || now->mode == AXIS_MODE_POSITION);
    for (size_t n = 0; now->state == AXIS_OPERATION_ENABLED && !waits && n < MODES; n++) {
        if (cia402_modes[n].axis_mode == now->mode) {
            return cia402_modes[n].mode;
        }
    }
    return c->setpoints.mode;
}

/* ---- the status word, 0x6041, and the error code, 0x603F ---- */

static uint32_t state_bits(const struct cia402 *c, const struct axis *a, uint32_t state)
{
    static const uint8_t of_state[] = {
        [AXIS_NOT_READY] = 0x00,         [AXIS_READY] = 0x23,      [AXIS_SWITCHED_ON] = 0x23, /* until operation */
        [AXIS_OPERATION_ENABLED] = 0x27, [AXIS_QUICK_STOP] = 0x07, [AXIS_FAULT_REACTION] = 0x0F, [AXIS_FAULT] = 0x08,
    };
    static const uint8_t at_rest[] = {[CIA402_DISABLED] = 0x40, [CIA402_READY] = 0x21, [CIA402_SWITCHED_ON] = 0x23};
    if (state != AXIS_SWITCH_ON_DISABLED) {
        return of_state[state];
    }
    return c->faults != a->faults.count ? 0x40u
                                        : at_rest[c->authority == AUTHORITY_STARTING ? CIA402_SWITCHED_ON : c->stage];
}

static uint32_t bits_if(bool condition, uint32_t bits)
{
    return condition ? bits : 0u;
}

static bool near_rpm_q4(int32_t x_q4, int32_t y_q4)
{
    return q15_abs(x_q4 - y_q4) <= AXIS_STANDSTILL_RPM_Q4;
}

/* For pp and hm: the motion is complete, or there is none. */
static bool has_arrived(const struct axis *a, const struct drive_status *now)
{
    return now->mode == AXIS_MODE_POSITION ? profile_is_done(&a->motion.profile)
                                           : now->mode == AXIS_MODE_SPEED && near_rpm_q4(now->speed_rpm_q4, 0);
}

static bool has_homed(const struct cia402 *c, const struct drive_status *now)
{
    const bool here = cia402_homes_here(c->setpoints.homing_method) && (c->word_before & CIA402_NEW_SET_POINT) != 0u;
    return (now->mode == AXIS_MODE_POSITION && now->homed) || here;
}

static uint32_t mode_bits(const struct cia402 *c, const struct axis *a, const struct drive_status *now)
{
    switch (cia402_mode_display(c, now)) {
    case CIA402_PV:
        return bits_if(near_rpm_q4(now->speed_rpm_q4, axis_forward(a) * (a->speed.target_rpm_q16 / 4096)),
                       CIA402_REACHED) |
               bits_if(near_rpm_q4(now->speed_rpm_q4, 0), CIA402_OF_MODE);
    case CIA402_PP:
        return bits_if(has_arrived(a, now), CIA402_REACHED) |
               bits_if(now->mode == AXIS_MODE_POSITION && (c->word_before & CIA402_NEW_SET_POINT) != 0u,
                       CIA402_OF_MODE);
    case CIA402_HM:
        return bits_if(has_arrived(a, now), CIA402_REACHED) | bits_if(has_homed(c, now), CIA402_OF_MODE);
    case CIA402_CSP:
    case CIA402_CSV:
    case CIA402_CST:
        return CIA402_OF_MODE;
    default:
        return 0;
    }
}

uint32_t cia402_status_word(const struct cia402 *c, const struct axis *a, const struct drive_status *now)
{
    const bool operates = now->state == AXIS_OPERATION_ENABLED;
    return state_bits(c, a, now->state) | bits_if(owner_allows(a, c->who).error == ERROR_NONE, CIA402_REMOTE) |
           bits_if(fault_any_warned(&a->reports), CIA402_WARNING) |
           bits_if(c->refusal.error != ERROR_NONE, CIA402_REFUSED) |
           bits_if(now->vbus_q15 >= a->tuning.v_min_q15, CIA402_VOLTAGE_THERE) |
           bits_if(operates && a->speed.at_limit, CIA402_LIMITED) | (operates ? mode_bits(c, a, now) : 0u);
}

#define FAULT_CODE(number, name, code, ...) [FAULT_##name] = (code),

uint32_t cia402_error_code(enum fault fault)
{
    static const uint16_t codes[FAULT_COUNT] = {FAULTS(FAULT_CODE)};
    return fault < FAULT_COUNT ? codes[fault] : 0xFF00u;
}

/* SPDX-License-Identifier: MIT */
#include "firmware/operate/cia402.h"

#define COMMAND_BITS (CIA402_SWITCH_ON | CIA402_VOLTAGE | CIA402_NO_QUICK_STOP | CIA402_ENABLE)
#define SHUTDOWN     (CIA402_VOLTAGE | CIA402_NO_QUICK_STOP)
#define SWITCHED_ON  (SHUTDOWN | CIA402_SWITCH_ON)
#define ENABLED      (SWITCHED_ON | CIA402_ENABLE)

/* ---- modes of operation ---- */

struct cia402_mode_row {
    int8_t mode;                                  /* enum cia402_mode; below 0: shown only */
    uint8_t axis_mode;                            /* enum axis_mode */
    enum { ON_EDGE, RPM, COUNTS, TORQUE } target; /* what it is given; pp and hm wait for an edge of bit 4 */
    struct outcome (*demand)(struct axis *a,
                             int32_t value); /* with the target, as soon as that or the mode is written */
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

/* ---- set-points accepted ---- */

void cia402_init(struct cia402 *c)
{
    *c = (struct cia402){.setpoints = {.mode = CIA402_PV, .homing_method = CIA402_HOME_INDEX}, .refusal = OUTCOME_OK};
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
    return method == CIA402_HOME_INDEX || method == CIA402_HOME_BLOCK || method == CIA402_HOME_HERE;
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

static bool axis_rests(const struct axis *a)
{
    return a->state == AXIS_SWITCH_ON_DISABLED && a->request == AXIS_REQUEST_NONE && !a->switching.under_way;
}

/* Or will be in the next millisecond: a fault is latched that leaves no controlled stop. */
static bool axis_is_faulty(const struct axis *a)
{
    return a->state == AXIS_FAULT || a->state == AXIS_FAULT_REACTION ||
           (a->faults.cause != FAULT_NONE && !a->reactions.stopping);
}

bool cia402_change_source(struct cia402 *c, struct axis *a, uint32_t source)
{
    c->refusal = drive_change_source(a, source);
    c->source_due = c->refusal.error == ERROR_NONE;
    return c->source_due;
}

/* After an end by itself, by a fault or at another's command, the whole sequence starts over. */
static void follow_axis(struct cia402 *c, const struct axis *a)
{
    if (c->source_due && !a->handover.under_way) {
        c->source_due = false;
        c->refusal = a->handover.outcome;
    }
    if (c->stage == CIA402_ENABLED && a->switching.outcome.error != ERROR_NONE && axis_rests(a)) {
        c->refusal = a->switching.outcome;
    }
    bool faulty = axis_is_faulty(a);
    if (faulty || a->faults.cause == FAULT_NONE) { /* else a stop for it goes on, and the fault itself is yet to come */
        faulty = faulty || c->faults != a->faults.count; /* and cleared since: at the console */
        c->faults = a->faults.count;
    }
    if (faulty || (c->stage == CIA402_ENABLED && axis_rests(a))) {
        c->stage = CIA402_DISABLED;
    }
}

static void switch_off_to(struct cia402 *c, struct axis *a, enum cia402_stage stage)
{
    c->refusal = axis_rests(a) ? OUTCOME_OK : drive_switch_off(a);
    c->stage = stage;
}

static void stop_quickly(struct cia402 *c, struct axis *a)
{
    if (a->state == AXIS_OPERATION_ENABLED) {
        c->refusal = drive_quick_stop(a);
    } else if (a->state != AXIS_QUICK_STOP) { /* which goes on */
        switch_off_to(c, a, CIA402_DISABLED);
    }
}

static void enable_operation(struct cia402 *c, struct axis *a)
{
    c->refusal = axis_rests(a) ? drive_switch_on(a) : OUTCOME_OK;
    c->stage = c->refusal.error == ERROR_NONE ? CIA402_ENABLED : CIA402_SWITCHED_ON;
    c->operates = false;
}

/* From a state in which the axis accepts commands. */
static void change_state(struct cia402 *c, struct axis *a, uint32_t command)
{
    if ((command & CIA402_VOLTAGE) == 0u) {
        switch_off_to(c, a, CIA402_DISABLED);
    } else if ((command & CIA402_NO_QUICK_STOP) == 0u) {
        stop_quickly(c, a);
    } else if (a->state == AXIS_QUICK_STOP) {
        return; /* it goes on */
    } else if ((command & CIA402_SWITCH_ON) == 0u) {
        switch_off_to(c, a, CIA402_READY);
    } else if (c->stage == CIA402_DISABLED) { /* no transition: shutdown comes first */
        if (command != ENABLED) {
            switch_off_to(c, a, CIA402_DISABLED);
        }
    } else if (command == SWITCHED_ON) {
        switch_off_to(c, a, CIA402_SWITCHED_ON);
    } else if (c->stage != CIA402_ENABLED) {
        enable_operation(c, a);
    }
}

/* ---- set-points ---- */

/* That of a mode which acts at once. */
static __attribute__((noinline)) void apply_target(struct cia402 *c, struct axis *a)
{
    const struct cia402_setpoints *const s = &c->setpoints;
    const struct cia402_mode_row *const row = find_mode(s->mode);
    if (row != NULL && row->demand != NULL) {
        c->refusal = row->demand(a, row->target == RPM      ? s->target_rpm
                                    : row->target == COUNTS ? s->target_counts
                                                            : milliamp_of(s->target_torque_pm, &a->params));
    }
}

static struct outcome start_homing(int32_t method, struct axis *a)
{
    if (method == CIA402_HOME_HERE) {
        return drive_set_zero(a);
    }
    return drive_command_home(a, method == CIA402_HOME_INDEX ? HOMING_INDEX : HOMING_BLOCK);
}

/* At the edge of bit 4. */
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
    c->target_due = false;
}

/* The edges of a new control word, and the change of state that it asks for. */
static uint32_t take_word(struct cia402 *c, struct axis *a)
{
    const uint32_t word = c->setpoints.control_word;
    const uint32_t rising = word & ~c->word_before;
    c->target_due = c->target_due || (c->word_before & ~word & CIA402_HALT) != 0u;
    c->word_before = word;
    c->word_due = false;
    if (!axis_is_faulty(a)) {
        change_state(c, a, word & COMMAND_BITS);
    } else if ((rising & CIA402_FAULT_RESET) != 0u) {
        c->refusal = drive_clear_fault(a);
    }
    if ((word & ENABLED) != ENABLED) {
        drive_withdraw(a); /* a level: what waits to switch on, after a fault, too, does so no more */
    }
    return rising;
}

void cia402_poll(struct cia402 *c, struct axis *a)
{
    follow_axis(c, a);
    const uint32_t rising = c->word_due ? take_word(c, a) : 0u;
    const bool operates = c->stage == CIA402_ENABLED && a->state == AXIS_OPERATION_ENABLED;
    if (operates && !c->operates) { /* continuous modes begin with the present target, a position waits for a new one */
        c->target_due = c->setpoints.mode != CIA402_CSP;
    }
    if (operates && (c->target_due || rising != 0u || !c->operates)) {
        operate(c, a, c->operates ? rising : c->setpoints.control_word & CIA402_HALT);
    }
    c->operates = operates;
}

/* ---- what is shown ---- */

static uint32_t state_bits(const struct cia402 *c, const struct axis *a, uint32_t state)
{
    static const uint8_t of_state[] = {
        [AXIS_NOT_READY] = 0x00,         [AXIS_READY] = 0x23,      [AXIS_SWITCHED_ON] = 0x23, /* until it operates */
        [AXIS_OPERATION_ENABLED] = 0x27, [AXIS_QUICK_STOP] = 0x07, [AXIS_FAULT_REACTION] = 0x0F, [AXIS_FAULT] = 0x08,
    };
    static const uint8_t at_rest[] = {
        [CIA402_DISABLED] = 0x40, [CIA402_READY] = 0x21, [CIA402_SWITCHED_ON] = 0x23, [CIA402_ENABLED] = 0x23};
    const enum cia402_stage stage = c->faults == a->faults.count ? c->stage : CIA402_DISABLED;
    return state == AXIS_SWITCH_ON_DISABLED ? at_rest[stage] : of_state[state];
}

static uint32_t if_so(bool condition, uint32_t bits)
{
    return condition ? bits : 0u;
}

static bool near_rpm_q4(int32_t x_q4, int32_t y_q4)
{
    return within_limit(x_q4 - y_q4, AXIS_STANDSTILL_RPM_Q4);
}

static uint32_t mode_bits(const struct cia402 *c, const struct axis *a, const struct drive_status *now)
{
    switch (now->mode) {
    case AXIS_MODE_SPEED:
        return if_so(near_rpm_q4(now->speed_rpm_q4, axis_forward(a) * (a->speed.target_rpm_q16 / 4096)),
                     CIA402_REACHED) |
               if_so(near_rpm_q4(now->speed_rpm_q4, 0), CIA402_OF_MODE);
    case AXIS_MODE_POSITION:
        return if_so(profile_is_done(&a->motion.profile), CIA402_REACHED) |
               if_so((c->word_before & CIA402_NEW_SET_POINT) != 0u, CIA402_OF_MODE) |
               if_so(now->homed && c->setpoints.mode == CIA402_HM, CIA402_REACHED | CIA402_OF_MODE);
    case AXIS_MODE_CYCLIC_POSITION:
    case AXIS_MODE_CYCLIC_SPEED:
    case AXIS_MODE_CYCLIC_TORQUE:
        return CIA402_OF_MODE;
    default:
        return 0;
    }
}

uint32_t cia402_status_word(const struct cia402 *c, const struct axis *a, const struct drive_status *now)
{
    const bool warned = (a->reports.warned[0] | a->reports.warned[FAULT_WORDS - 1u]) != 0u;
    const bool operates = now->state == AXIS_OPERATION_ENABLED;
    return state_bits(c, a, now->state) | CIA402_REMOTE | if_so(warned, CIA402_WARNING) |
           if_so(c->refusal.error != ERROR_NONE, CIA402_REFUSED) |
           if_so(now->vbus_q15 >= a->tuning.v_min_q15, CIA402_VOLTAGE_THERE) |
           if_so(operates && a->speed.at_limit, CIA402_LIMITED) | (operates ? mode_bits(c, a, now) : 0u);
}

int32_t cia402_mode_display(const struct cia402 *c, const struct drive_status *now)
{
    for (size_t n = 0; now->state == AXIS_OPERATION_ENABLED && n < MODES; n++) {
        if (cia402_modes[n].axis_mode == now->mode) {
            return cia402_modes[n].mode;
        }
    }
    return c->setpoints.mode;
}

/* SPDX-License-Identifier: MIT */
#include "firmware/operate/cia402.h"

#define COMMAND_BITS (CIA402_SWITCH_ON | CIA402_VOLTAGE | CIA402_NO_QUICK_STOP | CIA402_ENABLE)
#define SHUTDOWN     (CIA402_VOLTAGE | CIA402_NO_QUICK_STOP)
#define SWITCHED_ON  (SHUTDOWN | CIA402_SWITCH_ON)
#define ENABLED      (SWITCHED_ON | CIA402_ENABLE)

void cia402_init(struct cia402 *c)
{
    *c = (struct cia402){.wishes = {.mode = CIA402_PV, .homing_method = CIA402_HOME_INDEX}, .refusal = OUTCOME_OK};
}

/* ---- permitted wishes ---- */

static int32_t milliamp(int32_t torque_pm, const struct params *p)
{
    return (int32_t)((int64_t)torque_pm * p->i_rated_ma / 1000);
}

static bool within(int32_t x, int32_t limit)
{
    return x >= -limit && x <= limit;
}

static bool known_mode(int32_t mode)
{
    return mode == CIA402_PP || mode == CIA402_PV || mode == CIA402_TQ || mode == CIA402_HM || mode == CIA402_CSP ||
           mode == CIA402_CSV || mode == CIA402_CST;
}

static bool known_homing(int32_t method)
{
    return method == CIA402_HOME_INDEX || method == CIA402_HOME_BLOCK || method == CIA402_HOME_HERE;
}

bool cia402_may_wish(const struct cia402_wishes *w, const struct params *p)
{
    return known_mode(w->mode) && known_homing(w->homing_method) && within(w->target_rpm, p->speed_max_rpm) &&
           within(milliamp(w->target_torque_pm, p), p->i_max_ma);
}

void cia402_wish(struct cia402 *c, const struct cia402_wishes *w, bool word, bool target)
{
    c->wishes = *w;
    c->word_due = c->word_due || word;
    c->target_due = c->target_due || target;
}

/* ---- the state machine ---- */

static void note(struct cia402 *c, struct outcome outcome)
{
    c->refusal = outcome;
}

static bool axis_rests(const struct axis *a)
{
    return a->state == AXIS_SWITCH_ON_DISABLED && a->request == AXIS_REQUEST_NONE && !a->switching.under_way;
}

static bool axis_is_faulty(const struct axis *a)
{
    return a->state == AXIS_FAULT || a->state == AXIS_FAULT_REACTION;
}

bool cia402_hand_over(struct cia402 *c, struct axis *a, uint32_t source)
{
    const struct outcome outcome = drive_change_source(a, source);
    note(c, outcome);
    c->hands_over = outcome.error == ERROR_NONE;
    return c->hands_over;
}

/* The look has ended. */
static void follow_hand_over(struct cia402 *c, const struct axis *a)
{
    if (c->hands_over && !a->handover.under_way) {
        c->hands_over = false;
        note(c, a->handover.outcome);
    }
}

/* After an end by itself, by a fault or at another's command, the whole sequence starts over. */
static void follow(struct cia402 *c, const struct axis *a)
{
    follow_hand_over(c, a);
    if (c->stage == CIA402_ENABLED && a->switching.outcome.error != ERROR_NONE && axis_rests(a)) {
        note(c, a->switching.outcome);
    }
    if (axis_is_faulty(a) || (c->stage == CIA402_ENABLED && axis_rests(a))) {
        c->stage = CIA402_DISABLED;
    }
}

static void let_go(struct cia402 *c, struct axis *a, enum cia402_stage stage)
{
    if (!axis_rests(a)) {
        note(c, drive_switch_off(a));
    }
    c->stage = stage;
}

static void stop_quickly(struct cia402 *c, struct axis *a)
{
    if (a->state == AXIS_OPERATION_ENABLED) {
        note(c, drive_quick_stop(a));
    } else if (a->state != AXIS_QUICK_STOP) { /* which goes on */
        let_go(c, a, CIA402_DISABLED);
    }
}

static void enable(struct cia402 *c, struct axis *a)
{
    struct outcome outcome = OUTCOME_OK;
    if (axis_rests(a)) {
        outcome = drive_switch_on(a);
    }
    c->stage = outcome.error == ERROR_NONE ? CIA402_ENABLED : CIA402_SWITCHED_ON;
    c->operates = false;
    note(c, outcome);
}

/* From a state in which the axis accepts commands. */
static void change_state(struct cia402 *c, struct axis *a, uint32_t command)
{
    if ((command & CIA402_VOLTAGE) == 0u) {
        let_go(c, a, CIA402_DISABLED);
    } else if ((command & CIA402_NO_QUICK_STOP) == 0u) {
        stop_quickly(c, a);
    } else if (a->state == AXIS_QUICK_STOP) {
        return; /* it goes on */
    } else if ((command & CIA402_SWITCH_ON) == 0u) {
        let_go(c, a, CIA402_READY);
    } else if (c->stage == CIA402_DISABLED) { /* no transition: shutdown comes first */
        if (command != ENABLED) {
            let_go(c, a, CIA402_DISABLED);
        }
    } else if (command == SWITCHED_ON) {
        let_go(c, a, CIA402_SWITCHED_ON);
    } else if (c->stage != CIA402_ENABLED) {
        enable(c, a);
    }
}

/* ---- set-points ---- */

static int32_t target_milliamp(const struct cia402 *c, const struct axis *a)
{
    return milliamp(c->wishes.target_torque_pm, &a->params);
}

static struct outcome home(const struct cia402 *c, struct axis *a)
{
    if (c->wishes.homing_method == CIA402_HOME_HERE) {
        return drive_set_zero(a);
    }
    return drive_command_home(a, c->wishes.homing_method == CIA402_HOME_INDEX ? HOMING_INDEX : HOMING_BLOCK);
}

/* Set-points that act as soon as they, or their mode, are written. */
static __attribute__((noinline)) void aim(struct cia402 *c, struct axis *a)
{
    const struct cia402_wishes *const w = &c->wishes;
    switch (w->mode) {
    case CIA402_PV:
        note(c, drive_command_speed(a, w->target_rpm));
        break;
    case CIA402_TQ:
        note(c, drive_command_current(a, target_milliamp(c, a)));
        break;
    case CIA402_CSP:
        note(c, drive_command_cyclic_position(a, w->target_counts));
        break;
    case CIA402_CSV:
        note(c, drive_command_cyclic_speed(a, w->target_rpm));
        break;
    case CIA402_CST:
        note(c, drive_command_cyclic_current(a, target_milliamp(c, a)));
        break;
    default: /* pp and hm wait for an edge of bit 4 */
        break;
    }
}

static void begin(struct cia402 *c, struct axis *a)
{
    if (c->wishes.mode == CIA402_PP) {
        const bool relative = (c->wishes.control_word & CIA402_RELATIVE) != 0u;
        note(c, drive_command_position(a, c->wishes.target_counts, relative));
    } else if (c->wishes.mode == CIA402_HM) {
        note(c, home(c, a));
    }
}

static void operate(struct cia402 *c, struct axis *a, uint32_t rising)
{
    const uint32_t word = c->wishes.control_word;
    if ((rising & CIA402_HALT) != 0u) {
        note(c, drive_command_speed(a, 0));
    } else if ((word & CIA402_HALT) != 0u) {
        return;
    } else if ((rising & CIA402_NEW_SET_POINT) != 0u) {
        begin(c, a);
    } else if (c->target_due) {
        aim(c, a);
    }
    c->target_due = false;
}

/* The edges of a new control word, and the change of state that it asks for. */
static uint32_t take_word(struct cia402 *c, struct axis *a)
{
    const uint32_t word = c->wishes.control_word;
    const uint32_t rising = word & ~c->word_before;
    c->target_due = c->target_due || (c->word_before & ~word & CIA402_HALT) != 0u;
    c->word_before = word;
    c->word_due = false;
    if (!axis_is_faulty(a)) {
        change_state(c, a, word & COMMAND_BITS);
    } else if ((rising & CIA402_FAULT_RESET) != 0u) {
        note(c, drive_clear_fault(a));
    }
    if ((word & ENABLED) != ENABLED) {
        drive_withdraw(a); /* a level: what waits to switch on, after a fault, too, does so no more */
    }
    return rising;
}

void cia402_poll(struct cia402 *c, struct axis *a)
{
    follow(c, a);
    const uint32_t rising = c->word_due ? take_word(c, a) : 0u;
    const bool operates = c->stage == CIA402_ENABLED && a->state == AXIS_OPERATION_ENABLED;
    if (operates && !c->operates) { /* continuous modes begin with the present target, a position waits for a new one */
        c->target_due = c->wishes.mode != CIA402_CSP;
    }
    if (operates && (c->target_due || rising != 0u || !c->operates)) {
        operate(c, a, c->operates ? rising : c->wishes.control_word & CIA402_HALT);
    }
    c->operates = operates;
}

/* ---- what is shown ---- */

static uint32_t state_bits(const struct cia402 *c, const struct drive_status *now)
{
    switch (now->state) {
    case AXIS_NOT_READY:
        return 0x00u;
    case AXIS_READY:
    case AXIS_SWITCHED_ON: /* calibration and alignment */
        return 0x23u;
    case AXIS_OPERATION_ENABLED:
        return 0x27u;
    case AXIS_QUICK_STOP:
        return 0x07u;
    case AXIS_FAULT_REACTION:
        return 0x0Fu;
    case AXIS_FAULT:
        return 0x08u;
    default:
        return c->stage == CIA402_READY ? 0x21u : c->stage == CIA402_DISABLED ? 0x40u : 0x23u;
    }
}

static uint32_t if_so(bool condition, uint32_t bits)
{
    return condition ? bits : 0u;
}

static bool near_rpm_q4(int32_t x_q4, int32_t y_q4)
{
    return within(x_q4 - y_q4, AXIS_STANDSTILL_RPM_Q4);
}

static uint32_t mode_bits(const struct cia402 *c, const struct axis *a, const struct drive_status *now)
{
    switch (now->mode) {
    case AXIS_MODE_SPEED:
        return if_so(near_rpm_q4(now->speed_rpm_q4, a->speed.target_rpm_q16 / 4096), CIA402_REACHED) |
               if_so(near_rpm_q4(now->speed_rpm_q4, 0), CIA402_OF_MODE);
    case AXIS_MODE_POSITION:
        return if_so(profile_is_done(&a->motion.profile), CIA402_REACHED) |
               if_so((c->word_before & CIA402_NEW_SET_POINT) != 0u, CIA402_OF_MODE) |
               if_so(now->homed && c->wishes.mode == CIA402_HM, CIA402_REACHED | CIA402_OF_MODE);
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
    return state_bits(c, now) | CIA402_REMOTE | if_so(warned, CIA402_WARNING) |
           if_so(now->vbus_q15 >= a->tuning.v_min_q15, CIA402_VOLTAGE_THERE) |
           if_so(operates && a->speed.at_limit, CIA402_LIMITED) | (operates ? mode_bits(c, a, now) : 0u);
}

int32_t cia402_mode_display(const struct cia402 *c, const struct drive_status *now)
{
    static const int8_t modes[AXIS_MODES] = {
        [AXIS_MODE_SPEED] = CIA402_PV,
        [AXIS_MODE_TORQUE] = CIA402_TQ,
        [AXIS_MODE_POSITION] = CIA402_PP,
        [AXIS_MODE_HOMING] = CIA402_HM,
        [AXIS_MODE_CYCLIC_POSITION] = CIA402_CSP,
        [AXIS_MODE_CYCLIC_SPEED] = CIA402_CSV,
        [AXIS_MODE_CYCLIC_TORQUE] = CIA402_CST,
        [AXIS_MODE_LEARNING] = -1,
    };
    return now->state == AXIS_OPERATION_ENABLED && now->mode < AXIS_MODES ? modes[now->mode] : c->wishes.mode;
}

/* SPDX-License-Identifier: MIT */
/* The status word, 0x6041, and the error code, 0x603F. */
#include "firmware/operate/cia402.h"
#include "lib/q15.h"

static uint32_t state_bits(const struct cia402 *c, const struct axis *a, uint32_t state)
{
    static const uint8_t of_state[] = {
        [AXIS_NOT_READY] = 0x00,         [AXIS_READY] = 0x23,      [AXIS_SWITCHED_ON] = 0x23, /* until it operates */
        [AXIS_OPERATION_ENABLED] = 0x27, [AXIS_QUICK_STOP] = 0x07, [AXIS_FAULT_REACTION] = 0x0F, [AXIS_FAULT] = 0x08,
    };
    static const uint8_t at_rest[] = {[CIA402_DISABLED] = 0x40, [CIA402_READY] = 0x21, [CIA402_SWITCHED_ON] = 0x23};
    if (state != AXIS_SWITCH_ON_DISABLED) {
        return of_state[state];
    }
    return c->faults != a->faults.count ? 0x40u : at_rest[c->course == COURSE_STARTS ? CIA402_SWITCHED_ON : c->stage];
}

static uint32_t if_so(bool condition, uint32_t bits)
{
    return condition ? bits : 0u;
}

static bool near_rpm_q4(int32_t x_q4, int32_t y_q4)
{
    return q15_abs(x_q4 - y_q4) <= AXIS_STANDSTILL_RPM_Q4;
}

/* Of pp and hm: the motion under way, or that none is. */
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
        return if_so(near_rpm_q4(now->speed_rpm_q4, axis_forward(a) * (a->speed.target_rpm_q16 / 4096)),
                     CIA402_REACHED) |
               if_so(near_rpm_q4(now->speed_rpm_q4, 0), CIA402_OF_MODE);
    case CIA402_PP:
        return if_so(has_arrived(a, now), CIA402_REACHED) |
               if_so(now->mode == AXIS_MODE_POSITION && (c->word_before & CIA402_NEW_SET_POINT) != 0u, CIA402_OF_MODE);
    case CIA402_HM:
        return if_so(has_arrived(a, now), CIA402_REACHED) | if_so(has_homed(c, now), CIA402_OF_MODE);
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
    return state_bits(c, a, now->state) | if_so(owner_allows(a, c->who).error == ERROR_NONE, CIA402_REMOTE) |
           if_so(fault_warns(&a->reports), CIA402_WARNING) | if_so(c->refusal.error != ERROR_NONE, CIA402_REFUSED) |
           if_so(now->vbus_q15 >= a->tuning.v_min_q15, CIA402_VOLTAGE_THERE) |
           if_so(operates && a->speed.at_limit, CIA402_LIMITED) | (operates ? mode_bits(c, a, now) : 0u);
}

#define FAULT_CODE(number, name, code, ...) [FAULT_##name] = (code),

uint32_t cia402_error_code(enum fault fault)
{
    static const uint16_t codes[FAULT_COUNT] = {FAULTS(FAULT_CODE)};
    return fault < FAULT_COUNT ? codes[fault] : 0xFF00u;
}

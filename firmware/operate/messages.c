/* SPDX-License-Identifier: MIT */
#include "firmware/operate/messages.h"

#include "firmware/drive/start.h"

#include "message_texts.h"

_Static_assert(ERROR_TEXTS == ERROR_COUNT, "one text for each refusal");
_Static_assert(FAULT_HINTS == FAULT_COUNT && FAULT_DETAILS == FAULT_COUNT, "one of each for each fault");
_Static_assert(PARAM_TEXTS == sizeof(struct params) / sizeof(int32_t), "one text for each parameter");
_Static_assert(WAITING_MAX == MESSAGE_WAITING && sizeof message_pairs - 1u == 2u * (0x100u - MESSAGE_PAIR),
               "what unpacks them");

static const char *const state_names[] = {
    [AXIS_NOT_READY] = "not ready to switch on",
    [AXIS_SWITCH_ON_DISABLED] = "switch on disabled",
    [AXIS_READY] = "ready to switch on",
    [AXIS_SWITCHED_ON] = "switched on",
    [AXIS_OPERATION_ENABLED] = "operation enabled",
    [AXIS_QUICK_STOP] = "quick stop active",
    [AXIS_FAULT_REACTION] = "fault reaction active",
    [AXIS_FAULT] = "fault",
};

static const char *const phase_names[START_PHASES] = {
    [START_CALIBRATE] = "zeros of the current sensors",
    [START_WIRING] = "wiring test",
    [START_ALIGN] = "aligning",
    [START_CONFIRM] = "checking the offset",
    [START_FOLLOW] = "aligned",
    [START_FIELD] = "aligning",
    [START_IDENTIFY] = "identifying",
    [START_CATCH] = "does it turn already?",
    [START_CHECK_TURNING] = "wiring test",
    [START_INJECTION] = "saliency test",
    [START_HALL] = "Hall switches",
    [START_ALIGN_HALL] = "aligning",
    [START_LEARN_HALL] = "learning the Hall switches",
};

static const char *const mode_names[AXIS_MODES] = {
    [AXIS_MODE_SPEED] = "pv (profile velocity)",
    [AXIS_MODE_TORQUE] = "tq (torque)",
    [AXIS_MODE_POSITION] = "pp (profile position)",
    [AXIS_MODE_HOMING] = "hm (homing)",
    [AXIS_MODE_CYCLIC_POSITION] = "csp (cyclic synchronous position)",
    [AXIS_MODE_CYCLIC_SPEED] = "csv (cyclic synchronous velocity)",
    [AXIS_MODE_CYCLIC_TORQUE] = "cst (cyclic synchronous torque)",
    [AXIS_MODE_LEARNING] = "learning",
};

#define FAULT_NAME(number, name, code, allowed, initial, retry, stored, text, hint, details) [FAULT_##name] = (text),

static const char *const fault_names[FAULT_COUNT] = {[FAULT_NONE] = "none", FAULTS(FAULT_NAME)};

/* The nth of concatenated strings. */
static const char *nth(const char *texts, uint32_t n)
{
    while (n > 0u) {
        n -= *texts++ == '\0';
    }
    return texts;
}

const char *message_of_param(uint32_t row)
{
    return nth(param_texts, row);
}

const char *message_of_error(enum error error)
{
    const char *const text = error < ERROR_COUNT ? nth(error_texts, error) : "";
    return *text != '\0' ? text : "unknown error";
}

#define FEATURE_NAME(name, word) #word,

const char *message_of_feature(enum feature feature)
{
    static const char *const names[FEATURE_COUNT] = {FEATURES(FEATURE_NAME)};
    return names[feature];
}

const char *message_of_state(enum axis_state state)
{
    return state < sizeof state_names / sizeof state_names[0] ? state_names[state] : "unknown";
}

const char *message_of_owner(uint32_t owner)
{
    static const char *const names[OWNERS] = {"nobody", "the console", "Modbus", "CAN"};
    return owner < OWNERS ? names[owner] : "unknown";
}

const char *message_of_phase(uint32_t phase)
{
    return phase < START_PHASES ? phase_names[phase] : "unknown";
}

const char *message_of_mode(enum axis_mode mode)
{
    return mode < AXIS_MODES ? mode_names[mode] : "unknown";
}

const char *message_of_fault(enum fault cause)
{
    return cause < FAULT_COUNT ? fault_names[cause] : "unknown";
}

const char *message_fault_detail(enum fault cause)
{
    return cause < FAULT_COUNT ? nth(fault_details, cause) : "";
}

const char *message_of_reaction(enum reaction reaction)
{
    static const char *const names[REACTION_COUNT] = {"off", "stop", "warn", "carry"};
    return reaction < REACTION_COUNT ? names[reaction] : "unknown";
}

const char *message_of_update(enum pwm_update update)
{
    static const char *const names[] = {"at the valley", "at both ends", "at once"};
    return update < sizeof names / sizeof names[0] ? names[update] : "unknown";
}

char message_typed(char c)
{
    return c == ' ' ? '_' : (c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c);
}

const char *message_fault_hint(enum fault cause)
{
    return cause < FAULT_COUNT ? nth(fault_hints, cause) : "";
}

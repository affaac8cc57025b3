/* SPDX-License-Identifier: MIT */
#include "firmware/operate/signal_text.h"

#include <stddef.h>

#include "firmware/operate/text.h"

/* clang-format off */
static const struct {
    const char *name, *text;
} texts[] = {
    {"i_a", "phase current as sampled"},
    {"i_b", "phase current as sampled"},
    {"i_c", "phase current as sampled; without three sensors 0, or what the fabric reckons"},
    {"vbus", "bus voltage"},
    {"count", "encoder at the sample, within its turn"},
    {"gate", "GATE.STATUS, its bits"},
    {"sequence", "conversions, the sample's own number"},
    {"i_d", "current along the field, at the sample"},
    {"i_q", "current across the field, at the sample"},
    {"i_d_ref", "its reference"},
    {"i_q_ref", "its reference"},
    {"v_d", "voltage that answers the sample"},
    {"v_q", "voltage that answers the sample"},
    {"angle", "rotor, electrical, foreseen for the next sample"},
    {"turning", "electrical speed of the interrupt's observer"},
    {"field", "prescribed field, while one is prescribed"},
    {"flux_a", "flux observer, alpha"},
    {"flux_b", "flux observer, beta"},
    {"speed", "speed of the shaft"},
    {"speed_ref", "reference of the speed loop"},
    {"target", "target of the ramp"},
    {"position", "shaft from its zero, the lower 32 bits"},
    {"error", "following error"},
    {"winding", "temperature of the winding, reckoned"},
    {"state", "state of the drive, enum axis_state"},
    {"fault", "cause that is latched, enum fault"},
    {"time", "milliseconds since the start"},
};
/* clang-format on */

const char *signal_text(const char *name)
{
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        if (text_equal(texts[i].name, name)) {
            return texts[i].text;
        }
    }
    return "unknown";
}

const char *scope_word_of_when(enum capture_when when)
{
    static const char *const words[] = {[CAPTURE_NEVER] = "never",
                                        [CAPTURE_ABOVE] = "above",
                                        [CAPTURE_BELOW] = "below",
                                        [CAPTURE_RISES] = "rises",
                                        [CAPTURE_FALLS] = "falls"};
    return words[when];
}

enum capture_when scope_find_when(const char *word)
{
    uint32_t when = CAPTURE_FALLS;
    while (when > CAPTURE_NEVER && !text_equal(word, scope_word_of_when((enum capture_when)when))) {
        when--;
    }
    return (enum capture_when)when;
}

const char *scope_text_of_state(enum capture_state state)
{
    static const char *const texts_of[] = {[CAPTURE_OFF] = "off",
                                           [CAPTURE_WAITING] = "waits for its trigger",
                                           [CAPTURE_TRIGGERED] = "triggered",
                                           [CAPTURE_DONE] = "done"};
    return texts_of[state];
}

const char *scope_text_of_cause(enum capture_cause cause)
{
    static const char *const texts_of[] = {[CAPTURE_BY_NOTHING] = "",
                                           [CAPTURE_BY_SIGNAL] = " by the signal",
                                           [CAPTURE_BY_FAULT] = " by a fault",
                                           [CAPTURE_BY_COMMAND] = " by command"};
    return texts_of[cause];
}

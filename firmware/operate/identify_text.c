/* SPDX-License-Identifier: MIT */
#include "firmware/operate/identify_text.h"

#include "firmware/fault/fault.h"
#include "firmware/operate/messages.h"

static const struct {
    const char *name, *unit;
    int32_t milli; /* thousandths of the unit in one of the result's */
} quantities[IDENTIFY_QUANTITIES] = {
    [IDENTIFY_RESISTANCE] = {"resistance", " mohm", 1},
    [IDENTIFY_DEAD_TIME] = {"dead time", " ns", 100},
    [IDENTIFY_LD] = {"ld", " uH", 1},
    [IDENTIFY_LQ] = {"lq", " uH", 1},
    [IDENTIFY_POLE_PAIRS] = {"pole pairs", "", 1000},
    [IDENTIFY_COUNTS] = {"encoder counts", "", 1000},
    [IDENTIFY_DIRECTION] = {"encoder direction", "", 1000},
    [IDENTIFY_OFFSET] = {"offset", " degrees, electrical, at the index", 10},
    [IDENTIFY_FLUX] = {"flux", " uWb", 100},
    [IDENTIFY_INERTIA] = {"inertia", " kgmm2", 1},
    [IDENTIFY_COULOMB] = {"friction", " mNm", 1},
    [IDENTIFY_VISCOUS] = {"viscous friction", " uNms", 1},
    [IDENTIFY_LD_D2_BACK] = {"ld at -1 of rated current in d", " uH", 1},
    [IDENTIFY_LD_D1_BACK] = {"ld at -1/2 in d", " uH", 1},
    [IDENTIFY_LD_D1] = {"ld at 1/2 in d", " uH", 1},
    [IDENTIFY_LD_D2] = {"ld at 1 in d", " uH", 1},
    [IDENTIFY_LD_Q1] = {"ld at 1/3 of rated current in q", " uH", 1},
    [IDENTIFY_LD_Q2] = {"ld at 2/3 in q", " uH", 1},
    [IDENTIFY_LD_Q3] = {"ld at 1 in q", " uH", 1},
    [IDENTIFY_LQ_Q1] = {"lq at 1/3 in q", " uH", 1},
    [IDENTIFY_LQ_Q2] = {"lq at 2/3 in q", " uH", 1},
    [IDENTIFY_LQ_Q3] = {"lq at 1 in q", " uH", 1},
    [IDENTIFY_TORQUE_ID] = {"rated current in d for most torque, in mA", "", 1000},
    [IDENTIFY_TORQUE_IQ] = {"and in q, in mA", "", 1000},
    [IDENTIFY_TORQUE_FLUX] = {"flux in d there", " uWb", 100},
    [IDENTIFY_TORQUE_ACROSS] = {"flux in q there", " uWb", 100},
    [IDENTIFY_CROSS] = {"ldq by lqq there, in thousandths", "", 1000},
};

static const char *const reasons[IDENTIFY_REASONS] = {
    [IDENTIFY_NO_REASON] = "",
    [IDENTIFY_STOPPED] = "it ended before this was measured",
    [IDENTIFY_RATED_SMALL] = "i_rated_ma is too small for i_range_ma: the sensors hardly see it",
    [IDENTIFY_NO_CURRENT] = "next to no current answers the voltage: motor cable, i_rated_ma, i_range_ma",
    [IDENTIFY_NOT_RESISTIVE] = "the voltage does not grow with the current: does something turn the motor?",
    [IDENTIFY_TURNED] = "reluctance turns the rotor whenever the current changes",
    [IDENTIFY_SCATTER] = "repeated measurements differ by more than a tenth: contacts, a rotor that moves",
    [IDENTIFY_NO_ENCODER] = "angle_source says that there is no encoder",
    [IDENTIFY_NOT_FOLLOWED] = "the encoder does not show the field's turn: rotor blocked or loaded, encoder dead",
    [IDENTIFY_NOT_PUSHED] = "most of the rated current does not turn the rotor as it should: blocked, loaded",
    [IDENTIFY_NO_INDEX] = "no index from turn to turn: pole pairs and encoder counts cannot be told apart",
    [IDENTIFY_LOADED] = "a load drives the shaft or holds it back",
    [IDENTIFY_UNRESOLVED] = "it is too small for the sensors at the speeds that are allowed: speed_max_rpm",
    [IDENTIFY_TOO_LIGHT] =
        "this current turns the rotor too quickly to be measured meanwhile, or something holds it back",
    [IDENTIFY_RIPPLED] = "ripple and dead time hide it beside so small a current",
    [IDENTIFY_NOT_SALIENT] = "no current in d, or little, makes most torque: the magnets make nearly all of it",
    [IDENTIFY_TOO_SLOW] = "what the magnets induce is too little at the speeds that are allowed: speed_max_rpm",
};

static const char *const steps[IDENTIFY_STEPS] = {
    [IDENTIFY_STEP_NONE] = "none",          [IDENTIFY_STEP_PULSES] = "pulses",
    [IDENTIFY_STEP_HOLD] = "first current", [IDENTIFY_STEP_RESISTANCE] = "resistance",
    [IDENTIFY_STEP_AXES] = "axes",          [IDENTIFY_STEP_INDUCTANCE] = "inductance",
    [IDENTIFY_STEP_TURN] = "turn",          [IDENTIFY_STEP_PUSH] = "push",
    [IDENTIFY_STEP_INDEX] = "index",        [IDENTIFY_STEP_RAMPS] = "ramps",
    [IDENTIFY_STEP_SPEEDS] = "speeds",      [IDENTIFY_STEP_ALONG] = "map along d",
    [IDENTIFY_STEP_ACROSS] = "map across",  [IDENTIFY_STEP_TORQUE] = "map of most torque",
    [IDENTIFY_STEP_DONE] = "done",
};

static const char *step_name(uint32_t step)
{
    return step < IDENTIFY_STEPS ? steps[step] : "unknown";
}

static void put_result(struct text *out, uint32_t what, const struct identify_result *r)
{
    text_put(out, quantities[what].name);
    text_put(out, ": ");
    if (r->state == IDENTIFY_KNOWN && r->interval == 0) {
        text_put_int(out, r->value);
        text_put_line(out, ", exactly");
    } else if (r->state == IDENTIFY_KNOWN) {
        text_put_milli(out, r->value * quantities[what].milli);
        text_put(out, " +-");
        text_put_milli(out, r->interval * quantities[what].milli);
        text_put_line(out, quantities[what].unit);
    } else if (r->state == IDENTIFY_REFUSED) {
        text_put(out, "refused: ");
        text_put_line(out, r->reason < IDENTIFY_REASONS ? reasons[r->reason] : "unknown");
    } else {
        text_put_line(out, "not measured yet");
    }
}

static void put_end(struct text *out, const struct identify *d)
{
    if (d->step == IDENTIFY_STEP_NONE) {
        text_put_line(out, "identify has not run");
    } else if (!d->running && d->fault != FAULT_NONE) {
        text_put(out, "ended in step '");
        text_put(out, step_name(d->stopped_in));
        text_put(out, "' by a fault: ");
        text_put_line(out, message_of_fault((enum fault)d->fault));
    } else if (!d->running && d->stopped_in != IDENTIFY_STEP_DONE) {
        text_put(out, "ended in step '");
        text_put(out, step_name(d->stopped_in));
        text_put_line(out, "'");
    }
}

void identify_text_show(struct text *out, const struct identify *d)
{
    put_end(out, d);
    for (uint32_t what = 0; what < IDENTIFY_QUANTITIES && d->step != IDENTIFY_STEP_NONE; what++) {
        put_result(out, what, &d->results[what]);
    }
    if (d->step != IDENTIFY_STEP_NONE) {
        text_put(out, "time: ");
        text_put_milli(out, (int32_t)d->total_ms);
        text_put_line(out, " s");
    }
}

void identify_text_running(struct text *out, const struct identify *d)
{
    if (d->running) {
        text_put(out, "identify: step '");
        text_put(out, step_name(d->step));
        text_put_line(out, "'");
    }
}

void identify_text_used(struct text *out, int32_t changed)
{
    text_put_int(out, changed);
    text_put_line(out, " parameters changed; 'get all' lists them, 'on' takes them");
}

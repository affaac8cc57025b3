/* SPDX-License-Identifier: MIT */
/*
 * The script of identify: one line a step, in their order. A new step is one file, with identify_measure_NAME() and
 * identify_think_NAME(), its measurements in union identify_work, and one line here:
 *
 *     NAME, name    of the enum's and the functions
 *     "text"        what console and bus call it
 *     needs         enum identify_needs
 *     from, to      what it finds, of enum identify_quantity
 */
#ifndef FIRMWARE_COMMISSION_IDENTIFY_SCRIPT_H
#define FIRMWARE_COMMISSION_IDENTIFY_SCRIPT_H

enum identify_needs {
    IDENTIFY_NEEDS_VOLTAGE, /* held, for no current can be regulated yet */
    IDENTIFY_NEEDS_CURRENT,
    IDENTIFY_NEEDS_GRIP,    /* a current that holds the rotor; where reluctance would turn it a voltage of 0 brakes */
    IDENTIFY_NEEDS_ENCODER, /* turns */
    IDENTIFY_NEEDS_OPEN,    /* the same, and what it finds is not refused yet */
};

/* clang-format off */
#define IDENTIFY_SCRIPT(STEP) \
    STEP(PULSES, pulses, "pulses", VOLTAGE, RESISTANCE, LQ) /* identify_rough.c: a first inductance */ \
    STEP(HOLD, hold, "first current", CURRENT, RESISTANCE, DEAD_TIME) /* and a first resistance, from a steady current */ \
    STEP(RESISTANCE, resistance, "resistance", GRIP, RESISTANCE, DEAD_TIME) /* and what is left of the dead time's loss */ \
    STEP(AXES, axes, "axes", CURRENT, LD, LQ) /* identify_inductance.c: where they lie */ \
    STEP(INDUCTANCE, inductance, "inductance", CURRENT, LD, LQ) /* along each, for small changes */ \
    STEP(TURN, turn, "turn", ENCODER, DIRECTION, DIRECTION) /* the field turns slowly: counts per electrical turn */ \
    STEP(PUSH, push, "push", ENCODER, FLUX, INERTIA) /* across the magnets, forward and back: first flux and inertia */ \
    STEP(INDEX, index, "index", ENCODER, POLE_PAIRS, COUNTS) /* from one to the next: counts per turn, and so pole pairs */ \
    STEP(RAMPS, ramps, "ramps", ENCODER, FLUX, INERTIA) /* accelerating and braking at one current */ \
    STEP(SPEEDS, speeds, "speeds", ENCODER, OFFSET, VISCOUS) /* constant, both ways: friction, the encoder's offset */ \
    STEP(ALONG, along, "map along d", OPEN, LD_D2_BACK, LD_D2) /* identify_map.c: over the current, along the magnets */ \
    STEP(ACROSS, across, "map across", OPEN, LD_Q1, LQ_Q3) /* and across */ \
    STEP(TORQUE, torque, "map of most torque", OPEN, TORQUE_ID, CROSS) /* fluxes and coupling where torque needs least */

/* What identify finds: name, the text for it, unit, and thousandths of that in one of the value. */
#define IDENTIFY_RESULTS(RESULT) \
    RESULT(RESISTANCE, "resistance", " mohm", 1) /* one phase and the switches in its path, as warm as they are: uohm */ \
    RESULT(DEAD_TIME, "dead time", " ns", 100) /* what a leg loses in a period, in time at the bus voltage: 0.1 ns */ \
    RESULT(LD, "ld", " uH", 1) /* for small changes, no current otherwise: nH */ \
    RESULT(LQ, "lq", " uH", 1) \
    RESULT(POLE_PAIRS, "pole pairs", "", 1000) /* exactly */ \
    RESULT(COUNTS, "encoder counts", "", 1000) /* of the encoder per mechanical turn, exactly */ \
    RESULT(DIRECTION, "encoder direction", "", 1000) /* 1: it counts up as the field turns; -1: down */ \
    RESULT(OFFSET, "offset", " degrees, electrical, at the index", 10) /* where the index begins, turning forward */ \
    RESULT(FLUX, "flux", " uWb", 100) /* of the magnets, at almost no current and their present temperature */ \
    RESULT(INERTIA, "inertia", " kgmm2", 1) /* rotor and load: gmm2 */ \
    RESULT(COULOMB, "friction", " mNm", 1) /* does not depend on speed, bearings and iron: uNm */ \
    RESULT(VISCOUS, "viscous friction", " uNms", 1) /* grows with speed: nNms */ \
    /* the map, for small changes, nH; i_d in halves of the rated current, BACK: against the magnets, i_q = 0 */ \
    RESULT(LD_D2_BACK, "ld at -1 of rated current in d", " uH", 1) \
    RESULT(LD_D1_BACK, "ld at -1/2 in d", " uH", 1) \
    RESULT(LD_D1, "ld at 1/2 in d", " uH", 1) \
    RESULT(LD_D2, "ld at 1 in d", " uH", 1) \
    /* i_q in thirds of the rated current, i_d = 0 */ \
    RESULT(LD_Q1, "ld at 1/3 of rated current in q", " uH", 1) \
    RESULT(LD_Q2, "ld at 2/3 in q", " uH", 1) \
    RESULT(LD_Q3, "ld at 1 in q", " uH", 1) \
    RESULT(LQ_Q1, "lq at 1/3 in q", " uH", 1) \
    RESULT(LQ_Q2, "lq at 2/3 in q", " uH", 1) \
    RESULT(LQ_Q3, "lq at 1 in q", " uH", 1) \
    /* where rated current makes most torque, if i_d contributes to it */ \
    RESULT(TORQUE_ID, "rated current in d for most torque, in mA", "", 1000) \
    RESULT(TORQUE_IQ, "and in q, in mA", "", 1000) \
    RESULT(TORQUE_FLUX, "flux in d there", " uWb", 100) /* along the magnets */ \
    RESULT(TORQUE_ACROSS, "flux in q there", " uWb", 100) \
    RESULT(CROSS, "ldq by lqq there, in thousandths", "", 1000) /* L_dq / L_qq; with the sign of i_q */

/* Why it refuses one. */
#define IDENTIFY_REFUSALS(REASON) \
    REASON(STOPPED, "it ended before this was measured") /* off or a fault */ \
    REASON(RATED_SMALL, "i_rated_ma is too small for i_range_ma: the sensors hardly see it") \
    REASON(NO_CURRENT, "next to no current answers the voltage: motor cable, i_rated_ma, i_range_ma") \
    REASON(NOT_RESISTIVE, "the voltage does not grow with the current: does something turn the motor?") \
    REASON(TURNED, "reluctance turns the rotor whenever the current changes") \
    REASON(SCATTER, "repeated measurements differ by more than a tenth: contacts, a rotor that moves") \
    REASON(NO_ENCODER, "angle_source says that there is no encoder") \
    REASON(NOT_FOLLOWED, "the encoder does not show the field's turn: rotor blocked or loaded, encoder dead") \
    REASON(NOT_PUSHED, "most of the rated current does not turn the rotor as it should: blocked, loaded") \
    REASON(NO_INDEX, "no index from turn to turn: pole pairs and encoder counts cannot be told apart") \
    REASON(LOADED, "a load drives the shaft or holds it back") /* or speeds are not reached */ \
    REASON(TOO_SLOW, "what the magnets induce is too little at the speeds that are allowed: speed_max_rpm") \
    REASON(UNRESOLVED, "it is too small for the sensors at the speeds that are allowed: speed_max_rpm") \
    REASON(TOO_LIGHT, "this current turns the rotor too quickly to be measured meanwhile, or something holds it back") \
    REASON(SWINGS, "the speed swings as it grows: an elastic coupling, or a load that changes") \
    REASON(RIPPLED, "ripple and dead time hide it beside so small a current") /* phase currents change sign within a period */ \
    REASON(NOT_SALIENT, "no current in d, or little, makes most torque: the magnets make nearly all of it")
/* clang-format on */

#define IDENTIFY_STEP_OF(NAME, ...) IDENTIFY_STEP_##NAME,
#define IDENTIFY_NAME_OF(NAME, ...) IDENTIFY_##NAME,

enum identify_step {
    IDENTIFY_STEP_NONE,
    IDENTIFY_SCRIPT(IDENTIFY_STEP_OF) /* from TURN on the rotor turns; from PUSH on in its own frame */
    IDENTIFY_STEP_DONE,
    IDENTIFY_STEPS
};

enum identify_quantity { IDENTIFY_RESULTS(IDENTIFY_NAME_OF) IDENTIFY_QUANTITIES };

enum identify_reason { IDENTIFY_NO_REASON, IDENTIFY_REFUSALS(IDENTIFY_NAME_OF) IDENTIFY_REASONS };

#endif

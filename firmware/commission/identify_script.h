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
    STEP(PUSH, push, "push", ENCODER, FLUX, INERTIA) /* across the magnets, forth and back: first flux and inertia */ \
    STEP(INDEX, index, "index", ENCODER, POLE_PAIRS, COUNTS) /* from one to the next: counts per turn, and so pole pairs */ \
    STEP(RAMPS, ramps, "ramps", ENCODER, FLUX, INERTIA) /* accelerating and braking at one current */ \
    STEP(SPEEDS, speeds, "speeds", ENCODER, OFFSET, VISCOUS) /* constant, both ways: friction, the encoder's offset */ \
    STEP(ALONG, along, "map along d", OPEN, LD_D2_BACK, LD_D2) /* identify_map.c: over the current, along the magnets */ \
    STEP(ACROSS, across, "map across", OPEN, LD_Q1, LQ_Q3) /* and across */ \
    STEP(TORQUE, torque, "map of most torque", OPEN, TORQUE_ID, CROSS) /* fluxes and coupling where torque needs least */
/* clang-format on */

#define IDENTIFY_STEP_OF(NAME, ...) IDENTIFY_STEP_##NAME,

enum identify_step {
    IDENTIFY_STEP_NONE,
    IDENTIFY_SCRIPT(IDENTIFY_STEP_OF) /* from TURN on the rotor turns; from PUSH on in its own frame */
    IDENTIFY_STEP_DONE,
    IDENTIFY_STEPS
};

#endif

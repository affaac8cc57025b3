/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A conducting diode ends with its current; a floating terminal that would leave the rails starts one. Starting one can
 * push another terminal beyond a rail, hence the rounds. */
#include "diodes.h"

#include <math.h>

#include "coss.h"
#include "extremes.h"
#include "terminals.h"

#define RAIL_MARGIN_V 1e-6

static bool is_off(const struct inverter *inv, int k)
{
    return inv->leg[k] >= LEG_JUST_OFF;
}

bool diodes_any_off(const struct inverter *inv)
{
    return is_off(inv, 0) || is_off(inv, 1) || is_off(inv, 2);
}

/* A leg that has just lost its switches: the diode that takes over the current. */
static enum leg_state take_over(double i_a)
{
    if (fabs(i_a) < DIODE_ZERO_A) {
        return LEG_BLOCKED;
    }
    return i_a > 0 ? LEG_DIODE_LO : LEG_DIODE_HI;
}

static void settle_just_off(struct inverter *inv, const double i_motor_a[3])
{
    for (int k = 0; k < 3; k++) {
        if (inv->leg[k] != LEG_JUST_OFF) {
            continue;
        }
        if (coss_can_swing(inv, k)) {
            coss_begin_swing(inv, k, 1);
        } else {
            coss_enter(inv, k, inv->wire_open[k] ? LEG_BLOCKED : take_over(i_motor_a[k]));
        }
    }
}

static void block_if_off(struct inverter *inv, int k)
{
    if (is_off(inv, k)) {
        coss_enter(inv, k, LEG_BLOCKED);
    }
}

/* Two legs whose terminals are joined share their currents through the joint, so the motor's current in one of them
 * says little. With both off, the sum of the two decides: it needs one diode or the other, and is cut off when it
 * changes sign. With one off, its terminal hangs on the other leg, and only its voltage can start a diode. */
static void settle_joined(struct inverter *inv, const struct motor *motor, const double i_motor_a[3])
{
    int x = inv->short_from, y = inv->short_to;
    if (!is_off(inv, x) || !is_off(inv, y)) {
        block_if_off(inv, x);
        block_if_off(inv, y);
        return;
    }
    double sum_a = i_motor_a[x] + i_motor_a[y];
    double step_a = LONGEST_JOINED_STEP_S * (inv->bus_v + 2 * inv->p.diode_v) / terminals_inductance_h(motor);
    enum leg_state needed = take_over(sum_a);
    bool conducted = inv->leg[x] == needed || inv->leg[y] == needed;
    bool fresh = inv->leg[x] == LEG_JUST_OFF || inv->leg[y] == LEG_JUST_OFF;
    if (!conducted && !fresh && fabs(sum_a) < 2 * step_a) {
        needed = LEG_BLOCKED; /* it has only just passed zero */
    }
    coss_enter(inv, x, needed);
    coss_enter(inv, y, needed);
}

/* Ends the diodes whose current has ended. True if there was one. */
static bool settle_conducting(struct inverter *inv, const double i_a[3])
{
    bool changed = false;
    for (int k = 0; k < 3; k++) {
        bool lower_ends = inv->leg[k] == LEG_DIODE_LO && i_a[k] < DIODE_ZERO_A;
        bool upper_ends = inv->leg[k] == LEG_DIODE_HI && i_a[k] > -DIODE_ZERO_A;
        if (!lower_ends && !upper_ends) {
            continue;
        }
        if (coss_can_swing(inv, k)) {
            coss_begin_swing(inv, k, 0);
        } else {
            coss_enter(inv, k, LEG_BLOCKED);
        }
        changed = true;
    }
    return changed;
}

/* Starts the diode of the floating terminal that is furthest outside the rails. True if there was one. */
static bool start_diode(struct inverter *inv, const struct motor *motor, const struct circuit *c, const double i_a[3])
{
    double star_v[3], neutral_v = 0;
    int reference = -1, top = -1, bottom = -1;
    terminals_star_voltages(inv, motor, &c->source, star_v);
    for (int k = 0; k < 3; k++) {
        if (inv->wire_open[k]) {
            continue;
        }
        top = top < 0 || star_v[k] > star_v[top] ? k : top;
        bottom = bottom < 0 || star_v[k] < star_v[bottom] ? k : bottom;
        if (!circuit_floats(inv, k)) {
            reference = k;
            neutral_v = circuit_leg_v(inv, k, i_a[k]) - star_v[k];
        }
    }
    double high_v = inv->bus_v + inv->p.diode_v + RAIL_MARGIN_V, low_v = -inv->p.diode_v - RAIL_MARGIN_V;
    if (reference < 0) {
        /* Everything floats: current starts when the EMF between two terminals exceeds the bus. */
        if (top < 0 || star_v[top] - star_v[bottom] <= high_v - low_v) {
            return false;
        }
        coss_enter(inv, top, LEG_DIODE_HI);
        coss_enter(inv, bottom, LEG_DIODE_LO);
        return true;
    }
    int worst = -1;
    double worst_v = 0;
    for (int k = 0; k < 3; k++) {
        double v = neutral_v + star_v[k];
        double beyond_v = larger(v - high_v, low_v - v);
        if (inv->leg[k] == LEG_BLOCKED && !inv->wire_open[k] && beyond_v > worst_v) {
            worst = k;
            worst_v = beyond_v;
        }
    }
    if (worst < 0) {
        return false;
    }
    coss_enter(inv, worst, neutral_v + star_v[worst] > high_v ? LEG_DIODE_HI : LEG_DIODE_LO);
    return true;
}

static void hold_open(const struct inverter *inv, struct motor *motor, const struct circuit *c)
{
    for (int k = 0; k < 3; k++) {
        if (c->source.held[k]) {
            terminals_hold(inv, motor, k);
        }
    }
}

/* No leg floats, no wire is open or joined to another: currents are where they are. */
static bool all_driven(const struct inverter *inv)
{
    bool driven = inv->short_from < 0;
    for (int k = 0; k < 3; k++) {
        driven = driven && !circuit_floats(inv, k) && !inv->wire_open[k];
    }
    return driven;
}

void diodes_settle(struct inverter *inv, struct motor *motor)
{
    struct circuit c;
    double i_motor_a[3], i_a[3];
    terminals_currents(inv, motor, i_motor_a);
    if (inv->short_from >= 0) {
        settle_joined(inv, motor, i_motor_a);
    }
    settle_just_off(inv, i_motor_a);
    coss_settle(inv, i_motor_a);
    for (int round = 0; round < 6; round++) {
        circuit_build_now(inv, &c);
        circuit_leg_currents(inv, &c, i_motor_a, i_a);
        /* A diode started in an earlier round has no current yet, so only the first round ends diodes. */
        bool changed = round == 0 && settle_conducting(inv, i_a);
        if (all_driven(inv)) {
            return;
        }
        if (changed) {
            circuit_build_now(inv, &c);
        }
        hold_open(inv, motor, &c);
        terminals_currents(inv, motor, i_motor_a);
        circuit_leg_currents(inv, &c, i_motor_a, i_a);
        changed |= start_diode(inv, motor, &c, i_a);
        if (!changed) {
            return;
        }
    }
}

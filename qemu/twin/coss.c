/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "coss.h"

#include <math.h>

#include "diodes.h"
#include "extremes.h"
#include "terminals.h"

#define EDGE_ERROR_S  0.5e-9 /* a remainder of a swing worth less than an edge displaced by this is not integrated */
#define LONGEST_S     20e-6  /* a current that needs longer for its swing has ended */
#define PART_OF_CYCLE 0.7    /* of sqrt(L C): the trapezoidal rule is then 4 % off in the frequency of the ringing */
#define LEAST_PART    0.01   /* of a step that began at a rail without a current */

bool coss_can_swing(const struct inverter *inv, int k)
{
    return inv->node_f > 0 && !inv->wire_open[k] &&
           (inv->short_from < 0 || (k != inv->short_from && k != inv->short_to));
}

bool coss_swings(const struct inverter *inv)
{
    return inv->leg[0] == LEG_SWING || inv->leg[1] == LEG_SWING || inv->leg[2] == LEG_SWING;
}

static double node_v(const struct inverter *inv, int k)
{
    switch (inv->leg[k]) {
    case LEG_HIGH:
        return inv->supply.cap_v;
    case LEG_LOW:
        return 0;
    case LEG_BOTH:
        return inv->supply.cap_v / 2;
    case LEG_DIODE_LO:
        return -inv->p.diode_v;
    case LEG_DIODE_HI:
        return inv->supply.cap_v + inv->p.diode_v;
    default:
        return inv->node[k].v;
    }
}

/* What the capacitances of a node hold more at v1 than at v0. */
static double rise_j(const struct inverter *inv, double v0, double v1)
{
    return inv->node_f / 2 * (v1 - v0) * (v0 + v1 - inv->supply.cap_v);
}

/* The node jumps from v to where its new state ties it. One of its capacitances is charged out of the bus, through the
 * switch of the other, which discharges through it. */
static void charge(struct inverter *inv, int k, double v)
{
    double to_v = node_v(inv, k), charge_as = inv->node_f / 2 * (to_v - v), before_v = inv->supply.cap_v;
    bool low = inv->leg[k] == LEG_LOW || inv->leg[k] == LEG_DIODE_LO;
    charge_as = inv->leg[k] == LEG_BOTH ? 0 : (low ? -charge_as : charge_as);
    inv->energy_supply_j += supply_take(&inv->supply, &inv->p, charge_as);
    double drawn_j = charge_as * (before_v + inv->supply.cap_v) / 2;
    inv->energy_bridge_j += drawn_j;
    inv->energy_edges_j += drawn_j - rise_j(inv, v, to_v);
}

void coss_enter(struct inverter *inv, int k, enum leg_state state)
{
    double v = node_v(inv, k);
    inv->leg[k] = state;
    if (inv->node_f == 0) {
        return;
    }
    if (state == LEG_JUST_OFF || state == LEG_SWING || state == LEG_BLOCKED) {
        inv->node[k].v = v;
    } else {
        charge(inv, k, v);
    }
}

void coss_begin_swing(struct inverter *inv, int k, int turns)
{
    coss_enter(inv, k, LEG_SWING);
    inv->node[k].swing_s = 0;
    inv->node[k].direction = 0;
    inv->node[k].turns_allowed = turns;
}

/* The rail that a current drives the node to. */
static double rail_v(const struct inverter *inv, double i_a)
{
    return i_a > 0 ? -inv->p.diode_v : inv->supply.cap_v + inv->p.diode_v;
}

/* The way to the rail, and how long it takes this current. */
static double way_v(const struct inverter *inv, int k, double i_a)
{
    double rail = rail_v(inv, i_a);
    return i_a > 0 ? inv->node[k].v - rail : rail - inv->node[k].v;
}

static bool at_rail(const struct inverter *inv, double way, double i_a)
{
    double time_s = inv->node_f * way / fabs(i_a);
    return way <= 0 || way / 2 * time_s < EDGE_ERROR_S * inv->p.vbus_v;
}

void coss_settle(struct inverter *inv, const double i_a[3])
{
    for (int k = 0; k < 3; k++) {
        struct node *n = &inv->node[k];
        if (inv->leg[k] != LEG_SWING) {
            continue;
        }
        if (n->turns_allowed < 0 || n->swing_s > LONGEST_S) {
            coss_enter(inv, k, LEG_BLOCKED);
        } else if (fabs(i_a[k]) >= DIODE_ZERO_A && at_rail(inv, way_v(inv, k, i_a[k]), i_a[k])) {
            coss_enter(inv, k, i_a[k] > 0 ? LEG_DIODE_LO : LEG_DIODE_HI);
        }
    }
}

double coss_longest_step_s(const struct inverter *inv, const struct motor *motor, const double i_a[3])
{
    double dt_s = PART_OF_CYCLE * sqrt(terminals_inductance_h(motor) * inv->node_f);
    for (int k = 0; k < 3; k++) {
        double way = way_v(inv, k, i_a[k]);
        if (inv->leg[k] == LEG_SWING && fabs(i_a[k]) >= DIODE_ZERO_A && way > 0) {
            dt_s = lesser(dt_s, inv->node_f * way / fabs(i_a[k]));
        }
    }
    return dt_s;
}

/* The current as a straight line moves the node over the way after this part of the step. */
static double part_for(double way_as, double i_start_a, double i_end_a)
{
    double root = sqrt(larger(i_start_a * i_start_a + 2 * (i_end_a - i_start_a) * way_as, 0));
    return 2 * way_as / (i_start_a + root);
}

double coss_part_to_rail(const struct inverter *inv, const double i_start_a[3], const double i_end_a[3], double dt_s)
{
    double part = 1;
    for (int k = 0; k < 3; k++) {
        double moved_as = (i_start_a[k] + i_end_a[k]) / 2 * dt_s;
        if (inv->leg[k] != LEG_SWING || moved_as == 0) {
            continue;
        }
        double way = way_v(inv, k, moved_as), beyond = fabs(moved_as) / inv->node_f - way;
        if (beyond > 0 && !at_rail(inv, beyond, i_end_a[k])) {
            double sign = moved_as > 0 ? 1 : -1;
            double here = way > 0 ? part_for(inv->node_f * way / dt_s, sign * i_start_a[k], sign * i_end_a[k]) : 0;
            part = lesser(part, here);
        }
    }
    return larger(part, LEAST_PART);
}

/* Counts how often the current of a swing turns round. */
static void watch_direction(struct node *n, double i_a)
{
    int direction = i_a > DIODE_ZERO_A ? 1 : (i_a < -DIODE_ZERO_A ? -1 : n->direction);
    n->turns_allowed -= n->direction != 0 && direction != n->direction;
    n->direction = direction;
}

double coss_move(struct inverter *inv, const double i_start_a[3], const double i_end_a[3], double dt_s)
{
    double stored_j = 0;
    for (int k = 0; k < 3; k++) {
        struct node *n = &inv->node[k];
        if (inv->leg[k] == LEG_SWING) {
            double v = n->v - (i_start_a[k] + i_end_a[k]) / 2 * dt_s / inv->node_f;
            stored_j += rise_j(inv, n->v, v);
            n->v = v;
            n->swing_s += dt_s;
            watch_direction(n, i_end_a[k]);
        }
    }
    return stored_j;
}

double coss_stored_j(const struct inverter *inv)
{
    double sum_j = 0;
    for (int k = 0; k < 3; k++) {
        double v = node_v(inv, k), above_v = inv->supply.cap_v - v;
        sum_j += inv->node_f / 4 * (v * v + above_v * above_v);
    }
    return sum_j;
}

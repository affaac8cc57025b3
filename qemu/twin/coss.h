/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Output capacitance. The node of a leg carries that of two switches, one to each rail, taken as linear: Qoss / vbus.
 *
 * Both off, the phase's current moves the node, dv/dt = -i / (2 C), and the bus supplies half of it. A rail ends the
 * swing in a diode; a switch that closes before charges the rest at once and turns its energy into heat. A node that has
 * found neither rail when its current has reversed, returned and ended is left where it is: what rings on is damped by
 * eddy currents that the motor has not. The upper rail is here that of the bus capacitor: what its resistance drops
 * comes and goes with every edge, and a ceramic capacitor across the leg would bridge it. Two terminals that are joined
 * have no swing. */
#ifndef TWIN_COSS_H
#define TWIN_COSS_H

#include "inverter.h"

/* Every change of a leg's state passes here; the charge of its node changes with it. */
void coss_enter(struct inverter *inv, int k, enum leg_state state);
bool coss_swings(const struct inverter *inv);
/* Whether a leg with both switches off has a node to be moved. */
bool coss_can_swing(const struct inverter *inv, int k);
/* The current may turn round so many times before the swing is over. */
void coss_begin_swing(struct inverter *inv, int k, int turns);
/* Ends the swings that have reached a rail, or their time. */
void coss_settle(struct inverter *inv, const double i_a[3]);
/* Longest step for the swings as they are. */
double coss_longest_step_s(const struct inverter *inv, const struct motor *motor, const double i_a[3]);
/* The part of a step after which no node is beyond its rail; 1 if none is at its end. */
double coss_part_to_rail(const struct inverter *inv, const double i_start_a[3], const double i_end_a[3], double dt_s);
/* The step is taken; returns what the nodes hold more. */
double coss_move(struct inverter *inv, const double i_start_a[3], const double i_end_a[3], double dt_s);
double coss_stored_j(const struct inverter *inv);

#endif

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Three half bridges on a DC bus, at switch level: what each leg does to its terminal is decided by its two switches
 * and, when both are off, by its two diodes. Integrates itself and the motor between two events of the fabric. */
#ifndef TWIN_INVERTER_H
#define TWIN_INVERTER_H

#include <stdbool.h>

#include "keys.h"
#include "motor.h"
#include "simtime.h"

struct inverter_params {
    double vbus_v; /* of the supply */
    double supply_resistance_ohm;
    double supply_sinks; /* 1: takes current back; 0: a rectifier, the bus rises when the motor brakes */
    double bus_capacitance_f;
    double r_on_ohm;
    double diode_v;
    double turn_on_delay_s;
    double turn_off_delay_s;
    double oc_trip_a; /* of the comparators, on each leg and in the bus */
};

extern const struct config_key inverter_keys[];

/* Bit 2k of a gate mask is the high side of phase k, bit 2k+1 its low side. */
#define GATE_HIGH(phase) (1u << (2 * (phase)))
#define GATE_LOW(phase)  (2u << (2 * (phase)))

enum leg_state {
    LEG_HIGH,     /* high switch conducts */
    LEG_LOW,      /* low switch conducts */
    LEG_BOTH,     /* shoot-through */
    LEG_JUST_OFF, /* both off since a moment ago: not yet decided which of the following */
    LEG_DIODE_LO, /* both off, current out of the leg flows through the lower diode */
    LEG_DIODE_HI, /* both off, current into the leg flows through the upper diode */
    LEG_BLOCKED,  /* both off, no current: the terminal floats between the rails */
};

struct inverter {
    struct inverter_params p;
    unsigned gates;   /* as commanded by the fabric */
    unsigned conduct; /* switches on, after the drivers' delays */
    sim_ps switch_at[6];
    enum leg_state leg[3];
    double bus_v;
    bool wire_open[3];
    int short_from, short_to; /* terminals joined by short_ohm; short_from < 0: none */
    double short_ohm;
    bool overcurrent;                        /* the comparators' outputs now */
    double energy_supply_j, energy_bridge_j; /* out of the ideal source; out of the bus into the bridge */

    /* Told of each step once bridge and motor are at its end: no leg has changed in it, leg currents at both ends. */
    void (*on_step)(void *context, double dt_s, const double from_a[3], const double to_a[3]);
    void *on_step_context;
};

void inverter_init(struct inverter *inv, const struct inverter_params *p);

/* The fabric changes its six gate signals at time now. */
void inverter_command(struct inverter *inv, unsigned gates, sim_ps now);
/* The next instant at which a switch follows its gate, SIM_NEVER if none is pending. */
sim_ps inverter_next_switch(const struct inverter *inv);
/* Lets the switches follow whose time has come. */
void inverter_switch(struct inverter *inv, sim_ps now);

/* Integrates from `from` to `to`, during which no switch changes. Stops early, and returns the earlier time, at the
 * instant the comparators trip. */
sim_ps inverter_advance(struct inverter *inv, struct motor *motor, sim_ps from, sim_ps to);

/* Currents out of the legs; they differ from the motor's while two terminals are shorted. */
void inverter_leg_currents(const struct inverter *inv, const struct motor *motor, double i_a[3]);

void inverter_short(struct inverter *inv, int from, int to, double r_ohm);
void inverter_short_off(struct inverter *inv);
void inverter_open_wire(struct inverter *inv, int phase, bool open);

#endif

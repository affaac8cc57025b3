/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Three half bridges on a DC bus, at switch level: what each leg does to its terminal is decided by its two switches
 * and, when both are off, by the charge of its node and its two diodes. Integrates itself and the motor between two
 * events of the fabric (advance.c). */
#ifndef TWIN_INVERTER_H
#define TWIN_INVERTER_H

#include <stdbool.h>

#include "comparators.h"
#include "keys.h"
#include "motor.h"
#include "simtime.h"
#include "supply.h"

struct inverter_params {
    double vbus_v;       /* of the supply; of a rectifier, the peak of its pulses */
    double supply_sinks; /* 1: takes current back; 0: the bus rises when the motor brakes */
    double supply_resistance_ohm;
    double supply_inductance_h;
    double supply_r2_ohm; /* a battery's slow branch, in series: r2 beside c2 */
    double supply_c2_f;
    double rectifier_hz; /* of the mains before a six-pulse rectifier, which never sinks; 0: a dc supply */
    double bus_capacitance_f;
    double bus_esr_ohm;
    double chopper_ohm; /* brake resistor; 0: none */
    double chopper_on_v;
    double chopper_off_v;
    double r_on_ohm;
    double switch_v; /* constant part of a conducting switch's drop */
    double diode_v;
    double diode_ohm;
    double coss_c;      /* output charge of one switch at vbus_v */
    double switching_s; /* a switch's two hard edges take so long at full voltage and full current, together */
    double in_en; /* 1: drivers with an input and an enable for each leg; turn_on_delay_s has their dead time besides */
    double turn_on_delay_s;
    double turn_off_delay_s;
    double oc_trip_a; /* of the comparators, on each leg and in the bus */
    double oc_blanking_s;
    double oc_delay_s;
};

extern const struct config_key inverter_keys[];
/* NULL, or what does not go together. */
const char *inverter_mismatch(const struct inverter_params *p);

/* Bit 2k of a gate mask is the high side of phase k, bit 2k+1 its low side. */
#define GATE_HIGH(phase) (1u << (2 * (phase)))
#define GATE_LOW(phase)  (2u << (2 * (phase)))

enum leg_state {
    LEG_HIGH,     /* high switch conducts */
    LEG_LOW,      /* low switch conducts */
    LEG_BOTH,     /* shoot-through */
    LEG_JUST_OFF, /* both off since a moment ago: not yet decided which of the following */
    LEG_SWING,    /* both off, the current moves the node's charge from one rail towards the other */
    LEG_DIODE_LO, /* both off, current out of the leg flows through the lower diode */
    LEG_DIODE_HI, /* both off, current into the leg flows through the upper diode */
    LEG_BLOCKED,  /* both off, no current: the terminal floats between the rails */
};

/* What the node of a leg remembers (coss.h). */
struct node {
    double v;       /* while nothing ties it to a rail */
    double swing_s; /* since both switches are off */
    int direction;  /* sign of the current in this swing, 0 before there is any */
    int turns_allowed;
};

struct inverter {
    struct inverter_params p;
    unsigned gates;   /* as commanded by the fabric */
    unsigned conduct; /* switches on, after the drivers' delays */
    sim_ps switch_at[6];
    enum leg_state leg[3];
    struct node node[3];
    double node_f;   /* of one node: two switches */
    double leg_a[3]; /* currents out of the legs at the end of the last step */
    struct supply supply;
    double bus_v; /* at the bridge */
    int feeds[3]; /* the motor's phase at the wire of each leg */
    bool wire_open[3];
    int short_from, short_to; /* terminals joined by short_ohm; short_from < 0: none */
    double short_ohm;
    struct comparators comparators;
    bool overcurrent;                        /* what the gate block sees of them now */
    double energy_supply_j, energy_bridge_j; /* out of the ideal source; out of the bus into the bridge */
    double energy_conduction_j;              /* heat in switches and diodes */
    double energy_edges_j;                   /* heat of charging the nodes by a switch */
    double energy_switching_j;               /* heat of voltage and current together */

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
 * instant the gate block sees the comparators trip. */
sim_ps inverter_advance(struct inverter *inv, struct motor *motor, sim_ps from, sim_ps to);

/* Currents out of the legs; they differ from the motor's while two terminals are shorted. */
void inverter_leg_currents(const struct inverter *inv, const struct motor *motor, double i_a[3]);

void inverter_short(struct inverter *inv, int from, int to, double r_ohm);
void inverter_short_off(struct inverter *inv);
void inverter_open_wire(struct inverter *inv, int phase, bool open);
/* The wires of two legs exchanged, at the motor's terminals. */
void inverter_swap_wires(struct inverter *inv, int one, int other);
void inverter_swap_off(struct inverter *inv);
/* The fabric switches the brake chopper, if there is one. */
void inverter_chop(struct inverter *inv, bool on);
/* Connects its resistor, or not. */
void inverter_chopper(struct inverter *inv, bool enabled);

#endif

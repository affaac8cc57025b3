/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The seam between the plant and the fabric of one axis (docs/fabric.md). Behind it stand the C models (fabric_model.h) or the
 * verilated RTL (fabric_rtl.h). The plant goes from event to event: it asks when the fabric decides something next, brings the
 * physics there, shows the fabric its pins, and lets it take the event. */
#ifndef TWIN_FABRIC_H
#define TWIN_FABRIC_H

#include <stdbool.h>
#include <stdint.h>

#include "bit_streams.h"
#include "encoder.h"
#include "gate.h"
#include "simtime.h"

/* What can go wrong on the encoder's cable. */
enum cable_fault { CABLE_CUT, CABLE_FROZEN, CABLE_REVERSED, CABLE_ILLEGAL, CABLE_SLIP };

/* What an event was, as bits. */
enum { FABRIC_TRIGGERED = 1u << 0, FABRIC_CONVERTED = 1u << 1 };

/* Edges of the encoder that passed between two instants of the physics. */
struct shaft_way {
    int64_t edges;       /* of A and B since angle 0, after the way */
    int64_t moved;       /* of them, on the way */
    int64_t miscounted;  /* the receiver loses (negative, forwards) or doubles so many of them */
    sim_ps from;         /* when the way began */
    double last_edge_ps; /* when the last of them passed */
};

struct plant;

struct fabric {
    const struct fabric_ops *ops;
    /* Behind it is a motor in RTL (rtl_motor.c), in place of the C plant's: makes that what the RTL is now, and tells the RTL
     * what has been done to it from outside. NULL: the C plant is the motor. */
    void (*follow_motor)(struct fabric *f, struct plant *p);
    /* The wires that leave the fabric, after each call. */
    unsigned gates; /* to the drivers; bit 2k the high side of phase k, bit 2k+1 its low side */
    bool live, chops, interrupt;
    sim_ps valley_at; /* of the carrier, the last one */
    sim_ps ahead; /* how far an access took the fabric, which may be beyond its time: the bus has clocks of its own */
    bool prompt;  /* its pins have to be shown in time: the physics may never stay behind */
};

/* Times never decrease from call to call, but those of events, which may be ahead of all others by what the bus takes. */
struct fabric_ops {
    void (*reset)(struct fabric *f, sim_ps now);
    /* Registers of this axis, by offset. No event may be due before `now`. */
    uint32_t (*read)(struct fabric *f, uint32_t offset, sim_ps now);
    void (*write)(struct fabric *f, uint32_t offset, uint32_t value, sim_ps now);

    /* No wire changes by itself before this time; SIM_NEVER: not at all. */
    sim_ps (*next_event)(struct fabric *f);
    /* The physics, and what it shows at the pins, must have come that far before the event is taken. */
    bool (*needs_physics)(struct fabric *f);
    unsigned (*take_event)(struct fabric *f);
    void (*catch_up)(struct fabric *f, sim_ps now);
    /* Times no later than those of the next trigger, and of the end of the next conversion; SIM_NEVER: none in sight. */
    sim_ps (*next_trigger)(struct fabric *f);
    sim_ps (*next_conversion_end)(struct fabric *f);

    /* After a trigger: whether it starts a conversion; then its codes A B C and bus voltage; later those of channels that are
     * sampled behind the trigger. */
    bool (*listens)(const struct fabric *f);
    void (*convert)(struct fabric *f, const uint32_t code[4], sim_ps now);
    void (*sample)(struct fabric *f, int channel, uint32_t code);
    bool (*converting)(const struct fabric *f);
    /* The winding's sensor, as TEMP shows it; read behind each conversion. */
    void (*sense)(struct fabric *f, uint32_t code);

    /* What isolated modulators see over a step of the physics; NULL: this fabric has none. */
    void (*modulate)(struct fabric *f, const struct stretch *seen);

    /* Pins. Of those that stop, the latch says which it is. */
    void (*stop)(struct fabric *f, enum gate_latch which, bool stops, sim_ps now);
    void (*turn)(struct fabric *f, const struct shaft_way *way, const struct index_pulse *pulse);
    void (*show_hall)(struct fabric *f, unsigned state, double changed_ps);
    void (*disturb_cable)(struct fabric *f, enum cable_fault fault, int64_t value);
    /* Another design, with another identity. */
    void (*disguise)(struct fabric *f, bool other);

    /* Its carrier is to start with that of axis 0, which must not be ahead of it until then. */
    bool (*waits)(const struct fabric *f);
};

#endif

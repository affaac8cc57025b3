/* SPDX-License-Identifier: MIT */
/*
 * What an axis keeps over power-off: its parameters, the reactions to faults, and what it has learned of the encoder: the
 * field's angle at the index, and the shaft's cogging. The last two mean something only where there is an index, since the
 * counter begins wherever the rotor stands. docs/settings.md has the format.
 *
 * All of it by name: what is stored and not known here is passed over and counted, what is not stored keeps its initial value.
 */
#ifndef FIRMWARE_AXIS_KEEPING_H
#define FIRMWARE_AXIS_KEEPING_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/axis/fault.h"
#include "firmware/control/cogging.h"
#include "firmware/settings/error.h"
#include "firmware/settings/records.h"
#include "firmware/settings/slots.h"

struct axis;

/* A map that was stored, counted from the index, until the index is seen. */
struct keeping {
    struct cogging_map cogging;
    bool waits;
};

enum kept_state {
    KEPT_NONE,    /* nothing whole is stored */
    KEPT_LOADED,  /* in effect */
    KEPT_REFUSED, /* it does not hold together; nothing has changed */
};

struct kept {
    struct slots_view view;
    enum kept_state state;
    struct outcome problem;           /* why it was refused, */
    char about[RECORD_NAME_MOST + 1]; /* and what by; "" if it is the set as a whole */
    uint32_t unknown;                 /* records that were passed over, */
    char first_unknown[RECORD_NAME_MOST + 1];
    uint32_t missing; /* parameters that are not stored */
};

struct saved {
    uint32_t slot, number;
    bool worn;            /* the controller says that a page has been written too often */
    bool cogging_dropped; /* there is a map, and no index to count it from */
};

/*
 * Reads the newest whole slot and takes it over if every value is in its range and all hold together; else nothing changes.
 * Refused while the bridge is on. Why a set was refused is in `k`, and what is returned, too. Thread, some
 * milliseconds.
 */
struct outcome axis_load(struct axis *a, const struct slots *s, struct kept *k);

/* The same at the start, whatever state the axis begins in, before anybody can have switched it on. Thread, once. */
void axis_recall(struct axis *a, const struct slots *s, struct kept *k);

/*
 * Writes everything to the slot that is not the newest. Refused while the bridge is on, the shaft turns, or what is set does
 * not hold together: what is stored can be loaded. While a page is programmed no interrupt is served, and the clock of the axis
 * stands.
 * Thread.
 */
struct outcome axis_save(struct axis *a, const struct slots *s, struct saved *report);

/* Parameters and reactions become the initial ones; what is stored stays. Refused while the bridge is on. Thread. */
struct outcome axis_defaults(struct axis *a);

/* A map that was stored acts from the moment the index is seen. Thread, whenever it has time. */
void axis_remember(struct axis *a);

/* The same map, counted from a place `from_q32` further on. */
void keeping_turn(struct cogging_map *m, uint32_t from_q32);

/* The name under which the reaction to a fault is stored; NULL where the fault leaves no choice. */
const char *keeping_name_of_fault(enum fault cause);

#endif

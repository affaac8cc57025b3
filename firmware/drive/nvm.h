/* SPDX-License-Identifier: MIT */
/*
 * What an axis keeps through power-off: its parameters, the reactions to faults, and what it has learned with the encoder: the
 * field's angle at the index, and the shaft's cogging. The last two refer to the index, since the counter starts at an
 * arbitrary position. docs/settings.md has the format.
 *
 * Records are stored by name. Those that this image does not know, or whose value its build leaves out, are skipped and
 * counted, and the next save copies them, for the image that wrote them; what is not stored keeps its initial value.
 */
#ifndef FIRMWARE_DRIVE_NVM_H
#define FIRMWARE_DRIVE_NVM_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/cogging.h"
#include "firmware/fault/fault.h"
#include "firmware/settings/error.h"
#include "firmware/settings/slots.h"
#include "firmware/settings/tuning.h"

struct axis;

/* A stored map, relative to the index, until the index is seen. */
struct nvm_cogging {
    struct cogging_map map;
    bool pending;
};

enum nvm_state {
    NVM_NOTHING, /* nothing complete is stored */
    NVM_LOADED,  /* in effect */
    NVM_REFUSED, /* inconsistent; nothing has changed */
};

struct nvm_report {
    struct slots_view view;
    enum nvm_state state;
    struct outcome problem;          /* why it was refused */
    char about[RECORD_NAME_MAX + 1]; /* and by which record; "": by the set as a whole */
    uint32_t unknown;                /* records that were skipped */
    char first_unknown[RECORD_NAME_MAX + 1];
    uint32_t missing; /* parameters that are not stored */
};

struct saved {
    uint32_t slot, number;
    bool worn;            /* the controller reports a page at the end of its write cycles */
    bool cogging_dropped; /* there is a map but no index to count it from */
};

/*
 * Reads the newest complete slot and puts it into effect if every value is in range and the set is consistent; else nothing
 * changes. Refused while the bridge is on. `k` and the return value give the reason of a refusal. Thread, some milliseconds.
 */
struct outcome drive_load(struct axis *a, const struct slots *s, struct nvm_report *k);

/* The same at start-up, whatever the axis's first state, before it can have been switched on. Thread, once. */
void drive_load_at_boot(struct axis *a, const struct slots *s, struct nvm_report *k);

/*
 * Writes everything to the slot that is not the newest. Refused while the bridge is on, the shaft turns, or the settings are
 * inconsistent: what is stored can be loaded. While a page is programmed no interrupt is served and the axis' clock stops.
 * Thread.
 */
struct outcome drive_save(struct axis *a, const struct slots *s, struct saved *report);

/* Whether drive_save() would be refused now; the eNVM may still fail. Thread. */
struct outcome drive_may_save(const struct axis *a);

/*
 * Resets parameters and reactions to their initial values; storage stays, but the next save copies no unknown records. Refused
 * while the bridge is on. Thread.
 */
struct outcome drive_defaults(struct axis *a);

/* Puts a stored map into effect once the index is seen. Thread, in its idle loop. */
void drive_restore_cogging(struct axis *a);

/* The name under which a fault's reaction is stored; NULL if it cannot be chosen. */
const char *nvm_name_of_fault(enum fault cause);

#endif

/* SPDX-License-Identifier: MIT */
/*
 * The Hall switches from the parameters: `hall_states` lists the six states in the order of growing electrical angle, one digit
 * each, 4 C + 2 B + A; `hall_edge_1_cdeg` is the angle at which the first begins, and so on.
 */
#ifndef FIRMWARE_SETTINGS_HALL_TABLE_H
#define FIRMWARE_SETTINGS_HALL_TABLE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/settings/error.h"
#include "firmware/settings/params.h"

#define HALL_SECTORS   6u
#define HALL_STATES    8u
#define HALL_TURN_CDEG 36000

/* Sector limits: a switch this far out of place is broken, not misplaced. */
#define HALL_SECTOR_MIN_CDEG 2500
#define HALL_SECTOR_MAX_CDEG 9500

struct hall_table {
    uint32_t state[HALL_SECTORS];    /* by place, in order of growing electrical angle */
    uint32_t edge_q32[HALL_SECTORS]; /* start of that sector */
};

/* ERROR_NONE, or what is wrong with the table. Thread. */
enum error hall_table_of(const struct params *p, struct hall_table *t);

/* Writes the table to the parameters, rounded to nearest. Thread, or the slow loop with the bridge off. */
void hall_table_to_params(const struct hall_table *t, struct params *p);

#endif

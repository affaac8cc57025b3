/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Plays the events of the configuration at their times. */
#ifndef TWIN_SCENARIO_H
#define TWIN_SCENARIO_H

#include <stdbool.h>

#include "config.h"
#include "events.h"
#include "plant.h"
#include "simtime.h"
#include "sysreg.h"

#define SEALED_AT_ONCE UINT32_MAX /* no offset that may be read once more */

/* What events do to the board beyond the plant. */
struct scenario_board {
    struct plant *(*plant)(unsigned axis);
    void (*sync)(void);                             /* brings the plants to the present time */
    void (*changed)(void);                          /* inputs of a plant have changed */
    void (*delay_interrupt)(unsigned axis, sim_ps); /* hold its next FabricIrq back */
    void (*block_interrupt)(unsigned axis, bool);
    void (*power_cut)(void);
    void (*reset)(enum reset_cause);           /* of the MSS */
    void (*openocd)(void);                     /* resets it, by its script */
    void (*put_back)(void);                    /* what traffic on FIC_0 puts back */
    void (*interrupt)(int number, bool level); /* of the MSS */
    void (*seal_fabric)(bool, uint32_t);       /* whoever touches it, but for one read of an offset, ends the run */
    void (*hang_fabric)(bool);                 /* an access never ends, so the watchdog does */
    void (*end)(unsigned axis);                /* of its part of the run */
};

/* False if there is no memory for it. */
bool scenario_start(const struct config *config, const struct scenario_board *board);
/* Something happens now that the configuration does not know of; after scenario_start(). */
void scenario_play_now(const struct event *event);
/* The probes of an axis have these values now: what waits for them begins to count. */
void scenario_look(unsigned axis, const double *probe_values, double now_s);

#endif

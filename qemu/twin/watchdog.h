/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The MSS watchdog, configured by the Libero design: on, resets, and unless the configuration file says otherwise with the
 * shortest time-out that the guide allows, 32.2 s (docs/fabric.md). Time is handed in. */
#ifndef TWIN_WATCHDOG_H
#define TWIN_WATCHDOG_H

#include <stdint.h>

#include "simtime.h"

#define WATCHDOG_BASE  0x40005000u
#define WATCHDOG_BYTES 0x1000u

/* WDOGLOAD of SYSREG: the guide's least and reset value, and what fits. */
#define WATCHDOG_LOAD     0x1800000u
#define WATCHDOG_LOAD_MAX 0x3FFFFFFu

struct watchdog {
    sim_ps expires_at; /* SIM_NEVER: it stands, with so much */
    sim_ps left;
    uint32_t control;
    void (*reset)(void); /* time is up */
};

void watchdog_init(struct watchdog *w, void (*reset)(void));
/* Reloads, as a system reset does. */
void watchdog_reload(struct watchdog *w, sim_ps now);
/* Somebody has written WDOG_CR. */
void watchdog_switched(struct watchdog *w, sim_ps now);
uint32_t watchdog_read(const struct watchdog *w, uint32_t offset, sim_ps now);
void watchdog_write(struct watchdog *w, uint32_t offset, uint32_t value, sim_ps now);

#endif

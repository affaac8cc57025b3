/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The brake chopper of fabric slot 3: judges each sample of the bus voltage; without one for 65536 clocks it is off. */
#ifndef TWIN_CHOPPER_H
#define TWIN_CHOPPER_H

#include <stdbool.h>
#include <stdint.h>

#include "simtime.h"

struct chopper {
    bool enabled;
    uint32_t on_above, off_at; /* Q15 of the voltage range */
    bool on;
    sim_ps old_at; /* when the newest sample is too old; SIM_NEVER: nothing to turn off */
};

void chopper_reset(struct chopper *c);
void chopper_enable(struct chopper *c, bool enabled);
void chopper_sample(struct chopper *c, uint32_t vbus_q15, sim_ps now);
/* At old_at or later. */
void chopper_grow_old(struct chopper *c);

#endif

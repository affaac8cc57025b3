/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "chopper.h"

#define THRESHOLD_AFTER_RESET 0x7FFF
#define OLD_CLOCKS            65537 /* from a sample until the output has followed a full counter */

void chopper_reset(struct chopper *c)
{
    *c = (struct chopper){false, THRESHOLD_AFTER_RESET, THRESHOLD_AFTER_RESET, false, SIM_NEVER};
}

void chopper_enable(struct chopper *c, bool enabled)
{
    c->enabled = enabled;
    c->on = c->on && enabled;
}

void chopper_sample(struct chopper *c, uint32_t vbus_q15, sim_ps now)
{
    c->on = c->enabled && vbus_q15 > (c->on ? c->off_at : c->on_above);
    c->old_at = c->on ? now + OLD_CLOCKS * (sim_ps)SIM_PS_PER_FABRIC_CLOCK : SIM_NEVER;
}

void chopper_grow_old(struct chopper *c)
{
    c->on = false;
    c->old_at = SIM_NEVER;
}

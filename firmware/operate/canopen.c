/* SPDX-License-Identifier: MIT */
#include "firmware/operate/canopen.h"

#include "firmware/operate/canopen_parts.h"

#define NMT 0x000u

/* The highest rate that is known and no higher. */
static uint32_t rate_below(int32_t kbit_s)
{
    uint32_t rate = (uint32_t)kbit_s;
    while (!can_rate_is_known(rate)) {
        rate--;
    }
    return rate;
}

static void join(struct canopen *c)
{
    const struct params *const p = &c->drives[0].axis->params;
    c->node = p->can_node;
    c->kbit = p->can_kbit;
    c->recover = p->can_recover;
    if (c->node == 0) {
        can_close(c->can);
        c->state = NMT_BOOT;
        canopen_lose_no_master(c);
        return;
    }
    (void)can_open(c->can, CAN, rate_below(c->kbit), c->recover != 0); /* 20 kbit/s is the least */
    canopen_nmt_reset(c);
}

void canopen_start(struct canopen *c, struct can *can, struct axis *axes, const struct slots *slots)
{
    *c = (struct canopen){.can = can};
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        c->drives[n].axis = &axes[n];
        c->drives[n].slots = &slots[n];
        c->faults[n] = axes[n].faults.count;
        c->fault[n] = axes[n].faults.cause;
        cia402_init(&c->drives[n].cia402);
    }
    if (axes[0].params.can_node != 0) {
        join(c);
    }
}

static void follow_bus_parameters(struct canopen *c)
{
    const struct params *const p = &c->drives[0].axis->params;
    if (p->can_node != c->node || p->can_kbit != c->kbit || p->can_recover != c->recover) {
        join(c);
    }
}

static void take(struct canopen *c, const struct can_frame *f)
{
    const bool speaks = c->state == NMT_OPERATIONAL || c->state == NMT_PRE_OPERATIONAL;
    if (f->id == NMT) {
        canopen_nmt_take(c, f);
    } else if (speaks && f->id == c->sdo_in) {
        canopen_sdo_take(c, f);
    } else if (c->state == NMT_OPERATIONAL && f->id == c->sync_id) {
        canopen_pdo_sync(c);
    } else if (c->state != NMT_OPERATIONAL || !canopen_pdo_take(c, f)) {
        canopen_nmt_hear(c, f);
    }
}

static void poll_drives(struct canopen *c)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        cia402_poll(&c->drives[n].cia402, c->drives[n].axis);
    }
}

void canopen_poll(struct canopen *c)
{
    struct can_frame f;
    follow_bus_parameters(c);
    if (c->node == 0) {
        return;
    }
    while (can_take(c->can, &f)) {
        take(c, &f);    /* one that asks for a frame has CAN_REMOTE beside its identifier, and fits none */
        poll_drives(c); /* before the next word takes its place: edges are commands */
    }
    poll_drives(c);
    canopen_watch_faults(c);
    canopen_nmt_step(c);
    if (c->state == NMT_OPERATIONAL) {
        canopen_pdo_step(c);
    }
}

/* SPDX-License-Identifier: MIT */
#include "firmware/operate/canopen.h"

#define NMT 0x000u

static void join(struct canopen *c)
{
    c->line = canopen_line(&c->drives[0].axis->params);
    if (c->line.node == 0) {
        c->node = 0;
        can_close(c->can);
        c->state = NMT_BOOT;
        canopen_release(c);
        return;
    }
    const bool has_number = c->line.node <= (int32_t)CANOPEN_NODES;
    c->lss = (struct canopen_lss){.node = has_number ? (uint8_t)c->line.node : CANOPEN_NO_NUMBER,
                                  .kbit = (uint16_t)c->line.kbit};
    canopen_open(c, c->line.kbit);
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
        cia402_init(&c->drives[n].cia402, OWNER_CAN);
    }
    if (axes[0].params.can_node != 0) {
        join(c);
    }
}

static void follow_bus_parameters(struct canopen *c)
{
    const struct canopen_line now = canopen_line(&c->drives[0].axis->params);
    if (canopen_line_differs(&now, &c->line)) {
        join(c);
    }
    const int32_t heartbeat_ms = c->drives[0].axis->params.can_heartbeat_ms;
    if (heartbeat_ms != c->heartbeat_param) {
        c->heartbeat_param = heartbeat_ms;
        c->heartbeat_ms = (uint16_t)heartbeat_ms;
    }
}

static void take(struct canopen *c, const struct can_frame *f)
{
    const bool has_sdo = c->state == NMT_OPERATIONAL || c->state == NMT_PRE_OPERATIONAL;
    if (c->lss.change != LSS_NO_CHANGE) {
        return; /* between two rates */
    }
    if (f->id == LSS_COMMAND) {
        canopen_lss_take(c, f);
    } else if (c->node == CANOPEN_NO_NUMBER) {
        return;
    } else if (f->id == NMT) {
        canopen_nmt_take(c, f);
    } else if (has_sdo && f->id == c->sdo_in) {
        canopen_sdo_take(c, f);
    } else if (c->state == NMT_OPERATIONAL && f->id == c->sync_id) {
        canopen_pdo_sync(c);
    } else if (c->state != NMT_OPERATIONAL || !canopen_pdo_take(c, f)) {
        canopen_nmt_heartbeat(c, f);
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
    const bool was_stalled = c->tx_stalled;
    while (can_take(c->can, &f)) {
        canopen_note_progress(c);
        take(c, &f);    /* a remote frame has CAN_REMOTE in its identifier, which matches none */
        poll_drives(c); /* before the next control word replaces this one: edges are commands */
    }
    poll_drives(c);
    canopen_lss_step(c);
    canopen_watch_tx(c);
    if (was_stalled && !c->tx_stalled) {
        canopen_pdo_begin(c); /* what was queued has been dropped */
        canopen_repeat_errors(c);
    }
    if (!canopen_is_silent(c)) {
        canopen_send_errors(c); /* while silent they stay due */
    }
    canopen_nmt_step(c);
    if (c->state == NMT_OPERATIONAL && !canopen_is_silent(c)) {
        canopen_pdo_step(c);
    }
}

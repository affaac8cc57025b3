/* SPDX-License-Identifier: MIT */
#include "firmware/operate/canopen_parts.h"

enum { START = 1, STOP = 2, PRE_OPERATIONAL = 128, RESET_NODE = 129, RESET_COMMUNICATION = 130 };

#define HEARTBEAT           0x700u
#define EMERGENCY_HEARTBEAT 0x8130u
#define EMERGENCY_BUS_OFF   0x8140u /* the node is back from it */

static void send_state(struct canopen *c, enum nmt_state state)
{
    const uint8_t data = (uint8_t)state;
    c->beat_ms = canopen_now_ms(c);
    canopen_send(c, HEARTBEAT + c->node, &data, 1);
}

void canopen_nmt_reset(struct canopen *c)
{
    const uint32_t node = c->lss.node;
    c->node = c->lss.node;
    c->lss.configures = false;
    c->lss.matched = c->lss.part = 0u;
    c->sync_id = 0x80u;
    c->emergency_id = 0x80u + node;
    c->emergency_inhibit = 0u;
    c->consumer = 0u;
    c->heartbeat_ms = (uint16_t)c->drives[0].axis->params.can_heartbeat_ms;
    c->sdo_in = 0x600u + node;
    c->sdo_out = 0x580u + node;
    c->sdo.under_way = SDO_IDLE;
    c->beats = c->lost_heartbeat = false;
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        c->lost_nmt[n] = c->lost_nmt[n] || node == CANOPEN_NO_NUMBER; /* nobody could stop it any more */
    }
    canopen_pdo_defaults(c);
    canopen_forget_errors(c);
    send_state(c, NMT_BOOT);
    c->state = node == CANOPEN_NO_NUMBER ? NMT_BOOT : NMT_PRE_OPERATIONAL;
}

static void go_to(struct canopen *c, enum nmt_state state)
{
    const bool leaves = c->state == NMT_OPERATIONAL && state != NMT_OPERATIONAL;
    const bool begins = state == NMT_OPERATIONAL && c->state != NMT_OPERATIONAL;
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        c->lost_nmt[n] = !begins && (c->lost_nmt[n] || leaves);
    }
    if (begins) {
        canopen_pdo_begin(c);
    }
    c->state = state;
}

void canopen_nmt_take(struct canopen *c, const struct can_frame *f)
{
    if (f->count != 2u || (f->data[1] != 0u && f->data[1] != c->node)) {
        return;
    }
    canopen_hear(c);
    switch (f->data[0]) {
    case START:
        go_to(c, NMT_OPERATIONAL);
        break;
    case STOP:
        go_to(c, NMT_STOPPED);
        break;
    case PRE_OPERATIONAL:
        go_to(c, NMT_PRE_OPERATIONAL);
        break;
    case RESET_NODE:
    case RESET_COMMUNICATION:
        go_to(c, NMT_PRE_OPERATIONAL);
        canopen_nmt_reset(c);
        break;
    default:
        break;
    }
}

/* ---- heartbeats ---- */

void canopen_nmt_hear(struct canopen *c, const struct can_frame *f)
{
    if (f->count == 1u && (c->consumer & 0xFFFFu) != 0u && f->id == HEARTBEAT + (c->consumer >> 16)) {
        canopen_hear(c);
        c->beats = true;
        c->lost_heartbeat = false;
        c->heard_ms = canopen_now_ms(c);
    }
}

static void watch_master(struct canopen *c)
{
    if (c->beats && canopen_now_ms(c) - c->heard_ms > (c->consumer & 0xFFFFu)) {
        c->beats = false;
        c->lost_heartbeat = true;
        canopen_emergency(c, EMERGENCY_HEARTBEAT, c->consumer >> 16);
    }
}

static void watch_bus(struct canopen *c, bool off)
{
    if (canopen_is_silent(c)) {
        return; /* who cannot speak now tells of it later */
    }
    if (c->was_off && !off) {
        canopen_emergency(c, EMERGENCY_BUS_OFF, 0);
    }
    c->was_off = off;
}

/* It is a fault only of an axis that operates because this bus wanted it. */
static void tell_axis(struct canopen *c, uint32_t n, bool off)
{
    const bool ours = c->drives[n].cia402.stage == CIA402_ENABLED;
    c->lost_nmt[n] = c->lost_nmt[n] && ours;
    c->drives[n].axis->master_lost = !ours               ? 0u
                                     : off               ? (uint32_t)CANOPEN_LOST_BUS
                                     : c->lost_heartbeat ? (uint32_t)CANOPEN_LOST_HEARTBEAT
                                     : c->lost_nmt[n]    ? (uint32_t)CANOPEN_LOST_NMT
                                                         : 0u;
}

void canopen_lose_no_master(struct canopen *c)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        c->drives[n].axis->master_lost = 0u;
    }
}

void canopen_nmt_step(struct canopen *c)
{
    const bool off = can_state(c->can) == CAN_OFF, away = c->lss.change != LSS_NO_CHANGE;
    if (away) {
        c->heard_ms = canopen_now_ms(c); /* nobody could be heard */
    }
    watch_master(c);
    watch_bus(c, off);
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        tell_axis(c, n, off || away);
    }
    if (c->heartbeat_ms != 0u && canopen_now_ms(c) - c->beat_ms >= c->heartbeat_ms) {
        send_state(c, c->state);
    }
}

/* SPDX-License-Identifier: MIT */
#include "firmware/operate/canopen.h"

enum { START = 1, STOP = 2, PRE_OPERATIONAL = 128, RESET_NODE = 129, RESET_COMMUNICATION = 130 };

#define HEARTBEAT 0x700u

static void send_state(struct canopen *c, enum nmt_state state)
{
    const uint8_t data = (uint8_t)state;
    if (canopen_send(c, HEARTBEAT + c->node, &data, 1)) {
        c->heartbeat_sent_ms = canopen_now_ms(c);
    }
}

/* Only with an empty queue: a delayed heartbeat would vouch for a time that has passed. */
static void send_heartbeat(struct canopen *c)
{
    if (c->heartbeat_ms != 0u && canopen_now_ms(c) - c->heartbeat_sent_ms >= c->heartbeat_ms &&
        can_pending(c->can) == 0u) {
        send_state(c, c->state);
    }
}

/* Only an axis that this bus commands can lose its master. */
static bool commands_axis(const struct canopen *c, uint32_t n)
{
    return c->drives[n].axis->owner.who == OWNER_CAN;
}

static void lose_master(struct canopen *c, enum canopen_lost how)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        c->lost[n] = commands_axis(c, n) && c->lost[n] == 0u ? (uint8_t)how : c->lost[n];
    }
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
    c->heartbeat_param = c->drives[0].axis->params.can_heartbeat_ms;
    c->heartbeat_ms = (uint16_t)c->heartbeat_param;
    c->sdo_in = 0x600u + node;
    c->sdo_out = 0x580u + node;
    c->sdo.under_way = SDO_IDLE;
    c->master_alive = c->comm_clear_due = false;
    c->comm_errors = c->comm_errors_due = 0u;
    lose_master(c, CANOPEN_LOST_NMT); /* heartbeat supervision ends here */
    canopen_pdo_defaults(c);
    canopen_clear_history(c);
    canopen_forget_faults(c);
    send_state(c, NMT_BOOT);
    c->state = node == CANOPEN_NO_NUMBER ? NMT_BOOT : NMT_PRE_OPERATIONAL;
}

/* With the reaction `warn` a loss ends when the master is back; otherwise it has ended operation, and lasts. */
static void find_master(struct canopen *c, enum canopen_lost how)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        const bool warned = c->drives[n].axis->reactions.choice[FAULT_MASTER_LOST] == REACTION_WARN;
        c->lost[n] = warned && c->lost[n] == (uint8_t)how ? 0u : c->lost[n];
    }
}

static void go_to(struct canopen *c, enum nmt_state state)
{
    if (state == NMT_STOPPED || (c->state == NMT_OPERATIONAL && state != NMT_OPERATIONAL)) {
        lose_master(c, CANOPEN_LOST_NMT);
    } else if (state == NMT_OPERATIONAL && c->state != NMT_OPERATIONAL) {
        find_master(c, CANOPEN_LOST_NMT);
        canopen_pdo_begin(c);
    }
    c->state = state;
}

/* Off first, whichever line commands; then the profile as at power-on, so that no old target takes effect later. */
static void reset_node(struct canopen *c)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        struct bus_drive *const d = &c->drives[n];
        owner_stopped(d->axis, OWNER_CAN);
        (void)drive_switch_off(d->axis);
        owner_give_up(d->axis);
        cia402_init(&d->cia402, OWNER_CAN);
    }
}

void canopen_nmt_take(struct canopen *c, const struct can_frame *f)
{
    if (f->count != 2u || (f->data[1] != 0u && f->data[1] != c->node)) {
        return;
    }
    canopen_note_activity(c);
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
        reset_node(c);
        canopen_nmt_reset(c);
        break;
    case RESET_COMMUNICATION:
        canopen_nmt_reset(c);
        break;
    default:
        break;
    }
}

/* ---- heartbeats ---- */

static void lose_heartbeat(struct canopen *c)
{
    c->master_alive = false;
    canopen_set_error(c, COMM_ERROR_HEARTBEAT, c->consumer >> 16);
    lose_master(c, CANOPEN_LOST_HEARTBEAT);
}

/* A boot-up message from the heartbeat's producer: it has restarted, and no longer knows what it commanded. */
void canopen_nmt_heartbeat(struct canopen *c, const struct can_frame *f)
{
    if (f->count != 1u || (c->consumer & 0xFFFFu) == 0u || f->id != HEARTBEAT + (c->consumer >> 16)) {
        return;
    }
    if (f->data[0] == NMT_BOOT) {
        if (c->master_alive) {
            lose_heartbeat(c);
        }
        return;
    }
    canopen_note_activity(c);
    c->master_alive = true;
    canopen_clear_error(c, COMM_ERROR_HEARTBEAT);
    c->heartbeat_received_ms = canopen_now_ms(c);
}

static void watch_master(struct canopen *c)
{
    if (c->master_alive && canopen_now_ms(c) - c->heartbeat_received_ms > (c->consumer & 0xFFFFu)) {
        lose_heartbeat(c);
    }
}

static void watch_bus(struct canopen *c, bool off)
{
    if (canopen_is_silent(c)) {
        return; /* reported when frames can be sent again */
    }
    if (off) {
        canopen_set_error(c, COMM_ERROR_BUS_OFF, 0);
    } else {
        canopen_clear_error(c, COMM_ERROR_BUS_OFF);
    }
}

static void publish_master_lost(struct canopen *c, uint32_t n, bool off)
{
    const bool ours = commands_axis(c, n);
    c->lost[n] = ours ? c->lost[n] : 0u;
    c->drives[n].axis->master_lost = !ours ? 0u
                                     : off ? (uint32_t)CANOPEN_LOST_BUS
                                     : (c->comm_errors & 1u << COMM_ERROR_HEARTBEAT) != 0u
                                         ? (uint32_t)CANOPEN_LOST_HEARTBEAT
                                         : c->lost[n];
}

void canopen_release(struct canopen *c)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        owner_leave(c->drives[n].axis, OWNER_CAN);
        c->drives[n].axis->master_lost = 0u;
    }
}

void canopen_nmt_step(struct canopen *c)
{
    const uint32_t offs = c->can->offs;
    const bool off = can_state(c->can) == CAN_OFF || offs != c->bus_offs, away = c->lss.change != LSS_NO_CHANGE;
    c->bus_offs = offs;
    if (away) {
        c->heartbeat_received_ms = canopen_now_ms(c); /* no heartbeat could be received */
    }
    watch_master(c);
    watch_bus(c, off);
    if (off || away) { /* even if shorter than a poll */
        lose_master(c, CANOPEN_LOST_BUS);
    } else {
        find_master(c, CANOPEN_LOST_BUS);
    }
    if ((c->comm_errors & 1u << COMM_ERROR_HEARTBEAT) == 0u) {
        find_master(c, CANOPEN_LOST_HEARTBEAT);
    }
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        publish_master_lost(c, n, off || away);
    }
    send_heartbeat(c);
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The MSS's CAN controller (docs/silicon.md, CAN): 32 mailboxes each way, filters, error counters, bus-off. The bus is
 * can_bus.h. Its RAM holds anything at power-on. Test modes that loop back are not modelled. */
#ifndef TWIN_CAN_H
#define TWIN_CAN_H

#include <stdbool.h>
#include <stdint.h>

#include "can_frame.h"

#define CAN_BASE      0x40015000u
#define CAN_BYTES     0x620u
#define CAN_MAILBOXES 32

struct can_tx {
    uint32_t control, id, high, low;
};

struct can_rx {
    uint32_t control, id, high, low, mask, code, mask_data, code_data;
};

struct can {
    uint32_t status, enable, command, config, capture;
    uint32_t requests, stored; /* TxReq and MsgAv of the mailboxes, a bit each */
    uint32_t aborts;           /* likewise TxAbort */
    struct can_tx tx[CAN_MAILBOXES];
    struct can_rx rx[CAN_MAILBOXES];
    unsigned turn; /* of the mailboxes, where they take turns */
    unsigned tec, rec;
    bool bus_off;
};

/* What went wrong with a frame, as the bits of INT_STATUS. */
enum can_error { CAN_BIT_ERROR = 1u << 4, CAN_ACK_ERROR = 1u << 6, CAN_FORM_ERROR = 1u << 7 };

void can_power_on(struct can *c);
/* Registers as a reset leaves them; the RAM stays. */
void can_reset(struct can *c);
uint32_t can_read(struct can *c, uint32_t offset);
void can_write(struct can *c, uint32_t offset, uint32_t value);

bool can_interrupt(const struct can *c);
/* On the bus: hears and acknowledges; and whether it may speak. */
bool can_hears(const struct can *c);
bool can_acknowledges(const struct can *c);
/* Error passive: what it hears as wrong it does not destroy for others. */
bool can_passive(const struct can *c);
/* Nanoseconds of a bit, of a clock of 100 MHz. */
double can_bit_ns(const struct can *c);

/* The mailbox whose turn it is, -1: none has anything to send. */
int can_offer(const struct can *c, struct can_frame *frame);
/* How a frame of the mailbox ended: sent; not, because of an error; or somebody else's went first. */
void can_sent(struct can *c, int mailbox);
void can_failed(struct can *c, int mailbox, enum can_error error);
void can_lost_arbitration(struct can *c, int mailbox);

void can_received(struct can *c, const struct can_frame *frame);
/* Somebody else's frame was destroyed. */
void can_heard_error(struct can *c, enum can_error error);
/* In bus-off with AUTO_RESTART: it waits for 128 times 11 recessive bits, and these have been there. */
bool can_recovers(const struct can *c);
void can_recovered(struct can *c);

#endif

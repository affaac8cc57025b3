/* SPDX-License-Identifier: MIT */
#include "can.h"

struct can_frame host_can_said[64], host_can_heard[4096];
uint32_t host_can_saids, host_can_taken, host_can_heards;
uint32_t host_can_opened, host_can_closed, host_can_kbit, host_can_recovers;
uint32_t host_can_state, host_can_cut;

bool can_rate_is_known(uint32_t kbit_s)
{
    return kbit_s == 20u || kbit_s == 50u || kbit_s == 125u || kbit_s == 250u || kbit_s == 500u || kbit_s == 800u ||
           kbit_s == 1000u;
}

bool can_open(struct can *c, struct can_regs *regs, uint32_t kbit_s, bool recovers)
{
    c->regs = regs;
    host_can_opened++;
    host_can_kbit = kbit_s;
    host_can_recovers = recovers;
    return true;
}

void can_close(struct can *c)
{
    c->regs = NULL;
    host_can_closed++;
}

static void leave(const struct can_frame *f)
{
    if (host_can_heards < sizeof host_can_heard / sizeof host_can_heard[0]) {
        host_can_heard[host_can_heards++] = *f;
    }
}

/* While nobody takes one, the first is repeated and the others wait in the driver's queue, which is only as large as it is. */
static void leave_all(struct can *c)
{
    while (host_can_cut == 0u && c->tx_tail != c->tx_head) {
        leave(&c->tx[c->tx_tail++ % CAN_QUEUE]);
    }
}

bool can_send(struct can *c, const struct can_frame *f)
{
    leave_all(c);
    if (c->tx_head - c->tx_tail == CAN_QUEUE) {
        return false;
    }
    c->tx[c->tx_head++ % CAN_QUEUE] = *f;
    leave_all(c);
    return true;
}

uint32_t can_pending(const struct can *c)
{
    leave_all((struct can *)(uintptr_t)c);
    return c->tx_head - c->tx_tail;
}

void can_forget(struct can *c)
{
    c->tx_head = c->tx_tail + (c->tx_tail != c->tx_head ? 1u : 0u);
}

bool can_take(struct can *c, struct can_frame *f)
{
    (void)c;
    if (host_can_taken == host_can_saids) {
        return false;
    }
    *f = host_can_said[host_can_taken++];
    return true;
}

enum can_state can_state(const struct can *c)
{
    (void)c;
    return (enum can_state)host_can_state;
}

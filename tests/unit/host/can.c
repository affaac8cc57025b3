/* SPDX-License-Identifier: MIT */
#include "can.h"

struct can_frame host_can_said[64], host_can_heard[4096];
uint32_t host_can_saids, host_can_taken, host_can_heards;
uint32_t host_can_opened, host_can_closed, host_can_kbit, host_can_recovers;
uint32_t host_can_state;

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

bool can_send(struct can *c, const struct can_frame *f)
{
    (void)c;
    if (host_can_heards < sizeof host_can_heard / sizeof host_can_heard[0]) {
        host_can_heard[host_can_heards++] = *f;
    }
    return true;
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

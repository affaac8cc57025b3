/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A CAN bus that several twins and several programs of the host share: who is told what. Without sockets, which can_hub_main.c
 * has.
 *
 * Each end is greeted as socketcand does. It is a twin's from its first < node > on (can_link.h), a program's otherwise.
 * A frame goes to everybody else, in the order in which frames arrive here. A program is on the bus once it has asked for raw
 * mode, and then has sent something or waited for CAN_HUB_JOIN_MS: python-can takes for the answer all that is there, so
 * that a frame right behind it would spoil it.
 *
 * A twin whose bits are of another length destroys what others send, unless it is error passive; a program sends at the rate
 * of the twins. Time stamps are the twins', each its own; a program's frame has the last one. */
#ifndef TWIN_CAN_HUB_H
#define TWIN_CAN_HUB_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "can_link.h"
#include "socketcand.h"

#define CAN_HUB_ENDS      64
#define CAN_HUB_OUT_BYTES 262144u /* what is to be written to an end; frames beyond it are lost to that end */
#define CAN_HUB_JOIN_MS   500
#define CAN_HUB_FULL      "< error full >" /* in place of the greeting, to one more */

struct can_end {
    bool used, spoke, twin, listens;
    struct can_speaker speaker;
    int64_t attached_ms; /* in raw mode since then */
    int64_t moved_ms;    /* it has taken something, or had nothing to take */
    struct can_node node;
    struct can_others told;
    char out[CAN_HUB_OUT_BYTES];
    size_t waiting;
};

struct can_hub {
    struct can_end ends[CAN_HUB_ENDS];
    int64_t stamp_ns;
    bool had_twin;
};

/* In all of these `now_ms` is a clock that only goes on. */
/* A new end's number, -1: there is no room for one more. */
int can_hub_join(struct can_hub *h, int64_t now_ms);
void can_hub_leave(struct can_hub *h, int end);
void can_hub_hear(struct can_hub *h, int end, const char *bytes, size_t count, int64_t now_ms);
/* So much of `out` has been written. */
void can_hub_written(struct can_hub *h, int end, size_t count, int64_t now_ms);
/* Who has waited for long enough is on the bus. After each of those above, and from time to time while can_hub_waits(). */
void can_hub_settle(struct can_hub *h, int64_t now_ms);
bool can_hub_waits(const struct can_hub *h);

/* A program waits while a twin has much to take, unless that one takes nothing at all any more: one stands at a breakpoint,
 * say. Twins never wait. */
bool can_hub_may_speak(const struct can_hub *h, int end, int64_t now_ms);
unsigned can_hub_twins(const struct can_hub *h);
/* Whether a twin is there, or an end that may become one: it has not said anything yet. */
bool can_hub_is_needed(const struct can_hub *h);

#endif

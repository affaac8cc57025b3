/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What a twin and the bus that it shares with others (can_hub.h) say to each other, in commands like socketcand's:
 *   < node BIT_NS PASSIVE >  by a twin: how long a bit of its controller is, 0: it is not on the bus; whether it is error
 *                            passive, so that it destroys nothing
 *   < others HEAR DIFFER >   to a twin: whether somebody acknowledges what it sends; or destroys it, as his bits are others
 *   < wire FRAME NS >        either way: a frame (can_print), and when it ended by the clock of who has sent it
 *   < noise >                either way: a frame has been destroyed */
#ifndef TWIN_CAN_LINK_H
#define TWIN_CAN_LINK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "can_frame.h"

#define CAN_LINK_NOISE "< noise >"

struct can_node {
    uint32_t bit_ns;
    bool passive;
};

struct can_others {
    bool hear, differ;
};

enum can_link_kind { CAN_SAYS_NOTHING, CAN_SAYS_NODE, CAN_SAYS_OTHERS, CAN_SAYS_WIRE, CAN_SAYS_NOISE };

/* What a command (can_command) says; of the rest, what its kind has. */
struct can_said {
    enum can_link_kind kind;
    struct can_node node;
    struct can_others others;
    struct can_frame frame;
    int64_t ended_ns;
};

struct can_said can_link_read(const char *command);

/* Into CAN_TEXT_BYTES; returns the length. */
size_t can_link_node(struct can_node node, char *text);
size_t can_link_others(struct can_others others, char *text);
size_t can_link_wire(const struct can_frame *f, int64_t ended_ns, char *text);

#endif

/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "can_link.h"

#include <stdio.h>
#include <string.h>

#include "socketcand.h"

#define FRAME_TEXT 27 /* T, eight digits, the count, sixteen digits, the end */

struct can_said can_link_read(const char *command)
{
    struct can_said said = {.kind = CAN_SAYS_NOTHING};
    char frame[FRAME_TEXT];
    unsigned first, second;
    long long ended_ns;
    if (sscanf(command, "node %u %u", &first, &second) == 2) {
        said.kind = CAN_SAYS_NODE;
        said.node = (struct can_node){first, second != 0};
    } else if (sscanf(command, "others %u %u", &first, &second) == 2) {
        said.kind = CAN_SAYS_OTHERS;
        said.others = (struct can_others){first != 0, second != 0};
    } else if (sscanf(command, "wire %26s %lld", frame, &ended_ns) == 2 && strchr("tTrR", frame[0]) &&
               can_parse(frame, &said.frame)) {
        said.kind = CAN_SAYS_WIRE;
        said.ended_ns = ended_ns;
    } else if (strncmp(command, "noise", 5) == 0) {
        said.kind = CAN_SAYS_NOISE;
    }
    return said;
}

size_t can_link_node(struct can_node node, char *text)
{
    return (size_t)sprintf(text, "< node %u %d >", (unsigned)node.bit_ns, node.passive);
}

size_t can_link_others(struct can_others others, char *text)
{
    return (size_t)sprintf(text, "< others %d %d >", others.hear, others.differ);
}

size_t can_link_wire(const struct can_frame *f, int64_t ended_ns, char *text)
{
    char frame[FRAME_TEXT];
    (void)can_print(f, frame);
    return (size_t)sprintf(text, "< wire %s %lld >", frame, (long long)ended_ns);
}

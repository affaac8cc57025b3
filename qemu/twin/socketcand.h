/* SPDX-License-Identifier: GPL-2.0-or-later */
/* socketcand's protocol in raw mode, and that of Lawicel (slcan): frames as text, both ways. */
#ifndef TWIN_SOCKETCAND_H
#define TWIN_SOCKETCAND_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "can_frame.h"

#define CAN_TEXT_BYTES 96

/* One who speaks it: what he has said so far of a command, and whether he is on the bus. */
struct can_speaker {
    bool slcan;
    bool attached;
    char said[CAN_TEXT_BYTES];
    size_t length;
};

/* What a character leads to: an answer, a frame that he sends, or nothing yet. */
struct can_heard {
    const char *answer; /* NULL: none */
    bool sends;
    struct can_frame frame;
};

/* A frame as slcan has it, "t181201AB": whether it is one, and the length of what was printed. */
bool can_parse(const char *text, struct can_frame *f);
size_t can_print(const struct can_frame *f, char *text);

/* Of socketcand: what stands between < and > once the last character has come, NULL before; and what it leads to. */
const char *can_command(struct can_speaker *s, char c);
struct can_heard can_obey(struct can_speaker *s, const char *command);

/* `greeting`: what a connection begins with, "" for slcan. */
const char *can_greet(struct can_speaker *s);
struct can_heard can_hear(struct can_speaker *s, char c);
/* A frame on the bus as he is told of it; returns its length. */
size_t can_tell(const struct can_speaker *s, const struct can_frame *f, int64_t now_ns, char *text);

#endif

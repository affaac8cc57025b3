/* SPDX-License-Identifier: MIT */
/* A session: what a command needs to carry out its line and to answer. */
#ifndef FIRMWARE_OPERATE_SESSION_H
#define FIRMWARE_OPERATE_SESSION_H

#include "firmware/drive/drive.h"
#include "firmware/operate/stream.h"
#include "firmware/operate/text.h"
#include "firmware/scope/scope.h"
#include "firmware/system/postmortem.h"

struct session {
    struct text out;
    bool machine;                       /* a program reads the answers */
    struct axis *axis;                  /* the one that commands are for */
    struct scope *scope;                /* its scope */
    struct stream stream;               /* samples between the text */
    const struct postmortem *last_life; /* how the last life of the program ended */
    const struct slots *slots;          /* where settings are stored */
    const struct kept *kept;            /* what was found there at the start */
};

#endif

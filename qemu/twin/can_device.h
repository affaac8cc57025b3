/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Who else is on the CAN bus, at a character device of QEMU: a program that speaks slcan; or a bus that programs and other
 * twins share (can_link.h, can_hub.h). Without a device nobody is there. */
#ifndef TWIN_CAN_DEVICE_H
#define TWIN_CAN_DEVICE_H

#include <stdbool.h>

#include "can_frame.h"
#include "can_link.h"

struct can_device_hooks {
    unsigned (*room)(void); /* frames that may be sent now */
    void (*send)(const struct can_frame *f);
    void (*destroy)(void); /* instead of a frame there was noise */
};

/* Ends the process with one line if QEMU has no such device. */
void can_device_open(const char *chardev_id, bool slcan, struct can_device_hooks hooks);

/* Whether somebody acknowledges what the drive sends; or destroys it, because he has another bit rate. */
bool can_device_hears(void);
bool can_device_destroys(void);

/* What others are told: a frame of the drive, that one has been destroyed, and how the drive is on the bus. */
void can_device_tell(const struct can_frame *f);
void can_device_noise(void);
void can_device_node(struct can_node node);

#endif

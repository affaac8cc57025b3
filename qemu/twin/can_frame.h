/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A frame of CAN 2.0 as it stands on the wire (ISO 11898-1). */
#ifndef TWIN_CAN_FRAME_H
#define TWIN_CAN_FRAME_H

#include <stdbool.h>
#include <stdint.h>

struct can_frame {
    uint32_t id; /* 11 bits, or 29 if extended */
    bool extended, remote;
    uint8_t count; /* of data, 0 to 8; a remote frame asks for so many and has none */
    uint8_t data[8];
};

/* From its first bit to the end of the pause behind it, with the bits that stuffing adds. */
unsigned can_frame_bits(const struct can_frame *f);

/* Of two that begin at once the one with the lower number goes on. */
uint32_t can_frame_rank(const struct can_frame *f);

#endif

/* SPDX-License-Identifier: MIT */
/* Where the rotor was at an instant of the encoder's clock, and its speed since. */
#ifndef FIRMWARE_SOURCE_ROTOR_SEED_H
#define FIRMWARE_SOURCE_ROTOR_SEED_H

#include <stdint.h>

struct rotor_seed {
    uint32_t angle_q32;
    uint32_t clock;
    int32_t speed_q32; /* a sample */
};

#endif

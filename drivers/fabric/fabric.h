/* SPDX-License-Identifier: MIT */
/*
 * The fabric of one axis: four blocks in slots of 256 bytes (docs/fabric.md); one pointer reaches all of them. Tests put one
 * into RAM.
 */
#ifndef DRIVERS_FABRIC_FABRIC_H
#define DRIVERS_FABRIC_FABRIC_H

#include "drivers/board.h"
#include "drivers/fabric/adc.h"
#include "drivers/fabric/encoder.h"
#include "drivers/fabric/gate.h"
#include "drivers/fabric/pwm.h"
#include "drivers/reg.h"

#define FABRIC_SLOT_WORDS 64u

struct fabric {
    union {
        struct pwm_regs pwm;
        uint32_t slot_0[FABRIC_SLOT_WORDS];
    };
    union {
        struct adc_regs adc;
        uint32_t slot_1[FABRIC_SLOT_WORDS];
    };
    union {
        struct encoder_regs encoder;
        uint32_t slot_2[FABRIC_SLOT_WORDS];
    };
    union {
        struct gate_regs gate;
        uint32_t slot_3[FABRIC_SLOT_WORDS];
    };
};

REG_AT_OFFSET(struct fabric, pwm, 0x000);
REG_AT_OFFSET(struct fabric, adc, 0x100);
REG_AT_OFFSET(struct fabric, encoder, 0x200);
REG_AT_OFFSET(struct fabric, gate, 0x300);

_Static_assert(sizeof(struct fabric) == 0x400, "an axis's window");

#define FABRIC(axis) (REG_BLOCK(struct fabric, BOARD_FABRIC_BASE) + (axis))
#define FABRIC0      FABRIC(0)

#endif

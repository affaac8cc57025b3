/* SPDX-License-Identifier: MIT */
/*
 * All four blocks of the fabric as one struct, for code that is to reach them through one base register: every register
 * lies within the 4 KB that an immediate offset of LDR and STR covers. Layout: docs/fabric.md.
 */
#ifndef DRIVERS_FABRIC_FABRIC_H
#define DRIVERS_FABRIC_FABRIC_H

#include "drivers/board.h"
#include "drivers/fabric/adc.h"
#include "drivers/fabric/corepwm.h"
#include "drivers/fabric/encoder.h"
#include "drivers/fabric/gate.h"
#include "drivers/reg.h"

#define FABRIC_SLOT(type) __attribute__((aligned(BOARD_FABRIC_SLOT_BYTES))) type

struct fabric_regs {
    FABRIC_SLOT(struct corepwm_regs) pwm;
    FABRIC_SLOT(struct adc_regs) adc;
    FABRIC_SLOT(struct encoder_regs) encoder;
    FABRIC_SLOT(struct gate_regs) gate;
};

REG_AT_OFFSET(struct fabric_regs, pwm, 0u);
REG_AT_OFFSET(struct fabric_regs, adc, BOARD_ADC_BASE - BOARD_COREPWM_BASE);
REG_AT_OFFSET(struct fabric_regs, encoder, BOARD_ENC_BASE - BOARD_COREPWM_BASE);
REG_AT_OFFSET(struct fabric_regs, gate, BOARD_GATE_BASE - BOARD_COREPWM_BASE);

/*
 * The base. The compiler is not told its value: knowing it, it would load another constant for each block. Context: any.
 */
static inline __attribute__((always_inline)) struct fabric_regs *fabric_blocks(void)
{
    struct fabric_regs *blocks = REG_BLOCK(struct fabric_regs, BOARD_COREPWM_BASE);
    __asm("" : "+r"(blocks));
    return blocks;
}

#endif

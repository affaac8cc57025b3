/* SPDX-License-Identifier: MIT */
/* Nothing but checks: the assembler's numbers are those of the drivers. */
#include "drivers/fabric/offsets.h"

#include "drivers/board.h"
#include "drivers/fabric/adc.h"
#include "drivers/fabric/corepwm.h"
#include "drivers/fabric/encoder.h"
#include "drivers/fabric/gate.h"

#define AGREES(offset, base, type, field) \
    _Static_assert(FABRIC_BASE + (offset) == (base) + offsetof(type, field), #offset " is not where " #field " is")

AGREES(FABRIC_PWM1_POSEDGE, BOARD_COREPWM_BASE, struct corepwm_regs, PWM1_POSEDGE);
AGREES(FABRIC_PWM1_POSEDGE + 44, BOARD_COREPWM_BASE, struct corepwm_regs, PWM6_NEGEDGE);
AGREES(FABRIC_SYNC_UPDATE, BOARD_COREPWM_BASE, struct corepwm_regs, SYNC_UPDATE);
AGREES(FABRIC_ADC_STATUS, BOARD_ADC_BASE, struct adc_regs, STATUS);
AGREES(FABRIC_ADC_IA, BOARD_ADC_BASE, struct adc_regs, IA);
AGREES(FABRIC_ADC_IB, BOARD_ADC_BASE, struct adc_regs, IB);
AGREES(FABRIC_ENC_LATCHED, BOARD_ENC_BASE, struct encoder_regs, LATCHED);
AGREES(FABRIC_GATE_STATUS, BOARD_GATE_BASE, struct gate_regs, STATUS);

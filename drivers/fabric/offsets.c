/* SPDX-License-Identifier: MIT */
/* Nothing but checks: the assembler's numbers are those of the drivers. */
#include "drivers/fabric/offsets.h"

#include "drivers/fabric/fabric.h"

#define AGREES(offset, field) \
    _Static_assert((offset) == offsetof(struct fabric, field), #offset " is not where " #field " is")

_Static_assert(FABRIC_BASE == BOARD_FABRIC_BASE, "the assembler's base");
_Static_assert(FABRIC_HZ == BOARD_FABRIC_HZ, "drivers/board.h has another clock than drivers/fabric/offsets.h");

AGREES(FABRIC_PWM1_POSEDGE, pwm.PWM1_POSEDGE);
AGREES(FABRIC_PWM1_POSEDGE + 44, pwm.PWM6_NEGEDGE);
AGREES(FABRIC_SYNC_UPDATE, pwm.SYNC_UPDATE);
AGREES(FABRIC_ADC_STATUS, adc.STATUS);
AGREES(FABRIC_ADC_IA, adc.IA);
AGREES(FABRIC_ADC_IB, adc.IB);
AGREES(FABRIC_ENC_LATCHED, encoder.LATCHED);
AGREES(FABRIC_GATE_STATUS, gate.STATUS);

/* SPDX-License-Identifier: MIT */
/* Nothing but checks: the assembler's numbers are those of the drivers. */
#include "drivers/fabric/offsets.h"

#include "drivers/fabric/fabric.h"

#define AGREES(offset, field) \
    _Static_assert((offset) == offsetof(struct fabric, field), #offset " is not where " #field " is")

_Static_assert(FABRIC_BASE == BOARD_FABRIC_BASE, "the assembler's base");
_Static_assert(FABRIC_AXIS_BYTES == sizeof(struct fabric), "from one axis to the next");
_Static_assert(FABRIC_HZ == BOARD_FABRIC_HZ, "drivers/board.h has another clock than drivers/fabric/offsets.h");

AGREES(FABRIC_COMPARE_A, pwm.COMPARE_A);
AGREES(FABRIC_COMPARE_B, pwm.COMPARE_B);
AGREES(FABRIC_COMPARE_C, pwm.COMPARE_C);
AGREES(FABRIC_ADC_STATUS, adc.STATUS);
AGREES(FABRIC_ADC_IA, adc.IA);
AGREES(FABRIC_ADC_IB, adc.IB);
AGREES(FABRIC_ENC_LATCHED, encoder.LATCHED);
AGREES(FABRIC_GATE_STATUS, gate.STATUS);

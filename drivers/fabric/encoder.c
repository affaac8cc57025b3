/* SPDX-License-Identifier: MIT */
#include "drivers/fabric/encoder.h"

bool encoder_init(struct encoder_regs *encoder, uint32_t counts, bool reverse)
{
    encoder->CONTROL = 0u;
    if (counts < ENCODER_COUNTS_MIN || counts > ENCODER_COUNTS_MAX) {
        return false;
    }
    encoder->COUNTS = counts; /* sets the position to 0 */
    if (encoder->COUNTS != counts) {
        return false;
    }
    reg_clear(&encoder->STATUS, ENCODER_STATUS_INDEX_SEEN | ENCODER_STATUS_ILLEGAL | ENCODER_STATUS_SIGNAL_LOST);
    encoder->CONTROL = ENCODER_CONTROL_ENABLE | (reverse ? ENCODER_CONTROL_REVERSE : 0u);
    return true;
}

/* SPDX-License-Identifier: MIT */
#include "drivers/fabric/encoder.h"

bool encoder_init(uint32_t counts, bool reverse)
{
    ENCODER->CONTROL = 0u;
    if (counts < ENCODER_COUNTS_MIN || counts > ENCODER_COUNTS_MAX) {
        return false;
    }
    ENCODER->COUNTS = counts; /* sets the position to 0 */
    if (ENCODER->COUNTS != counts) {
        return false;
    }
    ENCODER->STATUS = ENCODER_STATUS_INDEX_SEEN | ENCODER_STATUS_ILLEGAL | ENCODER_STATUS_SIGNAL_LOST;
    ENCODER->CONTROL = ENCODER_CONTROL_ENABLE | (reverse ? ENCODER_CONTROL_REVERSE : 0u);
    return true;
}

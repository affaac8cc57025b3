/* SPDX-License-Identifier: MIT */
/*
 * What is left after a processor fault: the cause, the registers and the fault addresses, in RAM that a reset does not
 * clear, printed after the next boot.
 */
#ifndef FIRMWARE_SYSTEM_POSTMORTEM_H
#define FIRMWARE_SYSTEM_POSTMORTEM_H

#include <stdbool.h>
#include <stdint.h>

#include "startup/startup.h"

#define POSTMORTEM_MARK 0x50D1E5E5u

struct postmortem {
    uint32_t mark;
    uint32_t exception; /* number: 2 NMI, 3 hard fault, 4 memory, 5 bus, 6 usage, 16 + n interrupt n */
    uint32_t frame_valid;
    struct fault_frame frame;
    uint32_t exc_return;
    uint32_t cfsr, hfsr, mmfar, bfar;
    uint32_t check; /* sum of all words before it */
};

/* Whether the last reset followed a processor fault. Takes the record over; call once, early. Thread. */
bool postmortem_collect(void);

/* The record that was collected; NULL when there is none. Any context. */
const struct postmortem *postmortem_record(void);

#endif

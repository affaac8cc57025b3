/* SPDX-License-Identifier: MIT */
/*
 * What is left after a processor fault: the cause, the registers and the fault addresses, in RAM that a reset does not
 * clear, printed after the next boot.
 */
#ifndef FIRMWARE_SYSTEM_POSTMORTEM_H
#define FIRMWARE_SYSTEM_POSTMORTEM_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/mss/irq.h"
#include "startup/startup.h"

/* Interrupts that nobody handles, so that the fault entry does. */
#define POSTMORTEM_MSS_PLL    (STARTUP_SYSTEM_VECTORS + MSS_IRQ_PLL_LOCK_LOST)
#define POSTMORTEM_FABRIC_PLL (STARTUP_SYSTEM_VECTORS + MSS_IRQ_FABRIC_PLL_LOCK_LOST)
#define POSTMORTEM_ECC        (STARTUP_SYSTEM_VECTORS + MSS_IRQ_ECC_ERROR)

struct postmortem {
    bool valid;         /* a processor fault came before the last reset; the rest describes it */
    bool probe_died;    /* the last life ended between postmortem_probe(true) and postmortem_probe(false) */
    uint32_t exception; /* number: 2 NMI, 3 hard fault, 4 memory, 5 bus, 6 usage, 16 + n interrupt n */
    bool frame_valid;
    struct fault_frame frame;
    uint32_t exc_return;
    uint32_t cfsr, hfsr, mmfar, bfar;
    uint32_t edac; /* SYSREG_EDAC_* flags of the memories */
};

/* Writes the record. Only the fault entry calls it; the reset that must follow is the caller's. */
void postmortem_keep(const struct fault_frame *frame, uint32_t exc_return);

/* Takes over what the last life of the program left behind, and forgets it there. Thread, once, early. */
struct postmortem postmortem_collect(void);

/*
 * Says that the program is about to touch hardware that may not answer, or that it did. If it does not live to say the latter,
 * be it by a fault or by the watchdog, the next life knows. Thread.
 */
void postmortem_probe(bool under_way);

#endif

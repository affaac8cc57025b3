/* SPDX-License-Identifier: MIT */
/*
 * From main() to a device that may run a drive: sets up the core, then checks the clock, the reset cause and the fabric's
 * identity, in this order, and writes nothing to the fabric. And the record of a processor fault, which ended the last run: the
 * cause, the registers and the fault addresses, in RAM that a reset does not clear, printed after the next boot.
 */
#ifndef FIRMWARE_SYSTEM_BOOT_H
#define FIRMWARE_SYSTEM_BOOT_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/board.h"
#include "drivers/fabric/fabric.h"
#include "drivers/mss/sysreg.h"
#include "firmware/fault/fault.h"
#include "startup/startup.h"

/* Interrupts without a handler; the fault entry serves them. */
#define POSTMORTEM_MSS_PLL    (STARTUP_SYSTEM_VECTORS + MSS_IRQ_PLL_LOCK_LOST)
#define POSTMORTEM_FABRIC_PLL (STARTUP_SYSTEM_VECTORS + MSS_IRQ_FABRIC_PLL_LOCK_LOST)
#define POSTMORTEM_ECC        (STARTUP_SYSTEM_VECTORS + MSS_IRQ_ECC_ERROR)
#define POSTMORTEM_PUT_BACK   (STARTUP_SYSTEM_VECTORS + BOARD_IRQ_PUT_BACK)

struct postmortem {
    bool valid;         /* a processor fault came before the last reset; the rest describes it */
    bool probe_failed;  /* the last run ended between postmortem_probe(true) and postmortem_probe(false) */
    uint32_t exception; /* number: 2 NMI, 3 hard fault, 4 memory, 5 bus, 6 usage, 16 + n interrupt n */
    bool frame_valid;
    struct fault_frame frame;
    uint32_t exc_return;
    uint32_t cfsr, hfsr, mmfar, bfar;
    uint32_t edac;         /* SYSREG_EDAC_* flags of the memories */
    uint32_t reset_causes; /* SYSREG_CAUSE_* of the last reset, whether there is a record or not */
};

/* Writes the record. Only the fault entry calls it; the reset that must follow is the caller's. */
void postmortem_keep(const struct fault_frame *frame, uint32_t exc_return);

/* Reads the record of the last run, and clears it. Thread, once, early. */
struct postmortem postmortem_collect(void);

/*
 * Marks an access to hardware that may not respond: true before, false after it. If a fault or the watchdog ends the program in
 * between, the next run reads `probe_failed`. Thread.
 */
void postmortem_probe(bool under_way);

/* ==== start-up ==== */

/* What start-up releases from reset. */
#define BOOT_BLOCKS \
    (SYSREG_RESET_TIMER | SYSREG_RESET_MMUART0 | SYSREG_RESET_MMUART1 | SYSREG_RESET_FABRIC | SYSREG_RESET_FIC0 | \
     SYSREG_RESET_GPIO | SYSREG_RESET_GPOUT)

/* Cache, faults, stack guard, cycle counter, resets of the blocks that the drive needs. Thread, once, first. */
void boot_core(void);

/*
 * The gravest finding: why the fabric is not trusted, what the device lacks, or how its last run ended, described by `last`.
 * Reads a fabric register of the first axis, and only if the clock is right; with two motors a second one, since the design may
 * have one axis only. Thread, once.
 */
enum fault boot_check(const struct fabric *fabric, struct postmortem *last);

#endif

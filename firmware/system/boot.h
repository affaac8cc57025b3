/* SPDX-License-Identifier: MIT */
/*
 * From main() to a device that may run a drive: sets up the core, then checks the clock, the reset cause and the fabric's
 * identity, in this order, and writes nothing to the fabric.
 */
#ifndef FIRMWARE_SYSTEM_BOOT_H
#define FIRMWARE_SYSTEM_BOOT_H

#include "drivers/fabric/fabric.h"
#include "drivers/mss/sysreg.h"
#include "firmware/fault/fault.h"
#include "firmware/system/postmortem.h"

/* What start-up releases from reset. */
#define BOOT_BLOCKS \
    (SYSREG_RESET_TIMER | SYSREG_RESET_MMUART0 | SYSREG_RESET_MMUART1 | SYSREG_RESET_FABRIC | SYSREG_RESET_FIC0 | \
     SYSREG_RESET_GPIO | SYSREG_RESET_GPOUT)

/* Cache, faults, stack guard, cycle counter, resets of the blocks that the drive needs. Thread, once, first. */
void boot_core(void);

/*
 * The gravest finding: what puts the fabric in doubt, what the device lacks, or how its last run ended, which `last` describes.
 * Reads a fabric register, the first axis's, and only if the clock is right; with two motors a second one, since the design may
 * have one axis only. Thread, once.
 */
enum fault boot_check(const struct fabric *fabric, struct postmortem *last);

#endif

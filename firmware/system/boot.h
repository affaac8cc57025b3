/* SPDX-License-Identifier: MIT */
/*
 * From main() to a device that may carry a drive: the core is set up, the clock, the reset's cause and the fabric's identity
 * are looked at, in this order, and nothing of the fabric is written.
 */
#ifndef FIRMWARE_SYSTEM_BOOT_H
#define FIRMWARE_SYSTEM_BOOT_H

#include "drivers/fabric/fabric.h"
#include "firmware/axis/fault.h"
#include "firmware/system/postmortem.h"

/* Cache, faults, stack guard, cycle counter, resets of the blocks that the drive needs. Thread, once, first. */
void boot_core(void);

/*
 * What was found, the gravest first: what puts the fabric in doubt, what the device lacks, and how its last life ended, which
 * `last` describes. Reads one register of the fabric, and that only if the clock is right. Thread, once.
 */
enum fault boot_check(const struct fabric *fabric, struct postmortem *last);

#endif

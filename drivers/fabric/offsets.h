/* SPDX-License-Identifier: MIT */
/*
 * Addresses used by the current loop's interrupt, as numbers that an assembler can read. One base reaches all blocks
 * (docs/fabric.md: slots of 256 bytes). drivers/fabric/offsets.c checks them against the drivers' structures.
 */
#ifndef DRIVERS_FABRIC_OFFSETS_H
#define DRIVERS_FABRIC_OFFSETS_H

#define FABRIC_BASE       0x50000000
#define FABRIC_AXIS_BYTES 0x400
#define FABRIC_HZ         100000000

#define FABRIC_COMPARE_A   0x028
#define FABRIC_COMPARE_B   0x02C
#define FABRIC_COMPARE_C   0x030
#define FABRIC_ADC_STATUS  0x104
#define FABRIC_ADC_IA      0x108
#define FABRIC_ADC_IB      0x10C
#define FABRIC_ENC_LATCHED 0x20C
#define FABRIC_GATE_STATUS 0x304

#endif

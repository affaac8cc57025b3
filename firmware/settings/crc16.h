/* SPDX-License-Identifier: MIT */
/*
 * The CRC-16 of Modbus RTU (MODBUS over Serial Line, V1.02, 6.2.2): polynomial 0x8005, reflected, initial value 0xFFFF. That is
 * x + 1 times a primitive polynomial: up to 4 KB it detects every error of up to three bits.
 */
#ifndef FIRMWARE_SETTINGS_CRC16_H
#define FIRMWARE_SETTINGS_CRC16_H

#include <stddef.h>
#include <stdint.h>

#define CRC16_BYTES 2u

/* CRC of `count` bytes; sent low byte first. Over bytes followed by their CRC it is 0. Any context. */
uint16_t crc16(const uint8_t *bytes, size_t count);

#endif

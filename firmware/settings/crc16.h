/* SPDX-License-Identifier: MIT */
/*
 * The CRC-16 of Modbus RTU (MODBUS over Serial Line, V1.02, 6.2.2): polynomial 0x8005, reflected, begun with 0xFFFF. That is
 * x + 1 times a primitive polynomial: up to 4 KB it finds every error of three bits and fewer.
 */
#ifndef FIRMWARE_SETTINGS_CRC16_H
#define FIRMWARE_SETTINGS_CRC16_H

#include <stddef.h>
#include <stdint.h>

#define CRC16_BYTES 2u

/* Of so many bytes; the low byte goes first on a line. Of bytes with their CRC behind them it is 0. Any context. */
uint16_t crc16(const uint8_t *bytes, size_t count);

#endif

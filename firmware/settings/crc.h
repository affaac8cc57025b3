/* SPDX-License-Identifier: MIT */
/*
 * Check sums, with four bits a step: 16 entries suffice. Any context; about 20 cycles a byte.
 *
 * CRC-16 of Modbus RTU (MODBUS over Serial Line, V1.02, 6.2.2): polynomial 0x8005, reflected, initial value 0xFFFF. That is
 * x + 1 times a primitive polynomial: up to 4 KB it detects every error of up to three bits.
 *
 * CRC-32 of IEEE 802.3 (polynomial 0x04C11DB7, reflected, initial and final XOR all ones), as in zlib. Up to 11 KB it detects
 * every error of up to three bits (Koopman, "32-bit cyclic redundancy codes for internet applications", DSN 2002).
 *
 *     uint32_t crc = CRC32_START;
 *     crc = crc32_add(crc, bytes, count);     once per piece
 *     crc = crc32_end(crc);
 */
#ifndef FIRMWARE_SETTINGS_CRC_H
#define FIRMWARE_SETTINGS_CRC_H

#include <stddef.h>
#include <stdint.h>

#define CRC16_BYTES 2u
#define CRC32_START 0xFFFFFFFFu

/* CRC of `count` bytes; sent low byte first. Over bytes followed by their CRC it is 0. */
uint16_t crc16(const uint8_t *bytes, size_t count);

uint32_t crc32_add(uint32_t crc, const void *bytes, size_t count);

static inline uint32_t crc32_end(uint32_t crc)
{
    return ~crc;
}

#endif

/* SPDX-License-Identifier: MIT */
/*
 * CRC-32 of IEEE 802.3 (polynomial 0x04C11DB7, reflected, initial and final XOR all ones), as in zlib. Up to 11 KB it detects
 * every error of up to three bits (Koopman, "32-bit cyclic redundancy codes for internet applications", DSN 2002).
 *
 *     uint32_t crc = CRC32_START;
 *     crc = crc32_add(crc, bytes, count);     once per piece
 *     crc = crc32_end(crc);
 *
 * Thread; about 20 cycles a byte.
 */
#ifndef FIRMWARE_SETTINGS_CRC32_H
#define FIRMWARE_SETTINGS_CRC32_H

#include <stddef.h>
#include <stdint.h>

#define CRC32_START 0xFFFFFFFFu

uint32_t crc32_add(uint32_t crc, const void *bytes, size_t count);

static inline uint32_t crc32_end(uint32_t crc)
{
    return ~crc;
}

#endif

/* SPDX-License-Identifier: MIT */
#include "firmware/settings/crc.h"

static uint32_t crc_add(uint32_t crc, const uint8_t *bytes, size_t count, const uint32_t of_nibble[16])
{
    for (size_t n = 0; n < count; n++) {
        crc ^= bytes[n];
        crc = (crc >> 4) ^ of_nibble[crc & 15u];
        crc = (crc >> 4) ^ of_nibble[crc & 15u];
    }
    return crc;
}

uint16_t crc16(const uint8_t *bytes, size_t count)
{
    static const uint32_t of_nibble[16] = {0x0000, 0xCC01, 0xD801, 0x1400, 0xF001, 0x3C00, 0x2800, 0xE401,
                                           0xA001, 0x6C00, 0x7800, 0xB401, 0x5000, 0x9C01, 0x8801, 0x4400};
    return (uint16_t)crc_add(0xFFFFu, bytes, count, of_nibble);
}

uint32_t crc32_add(uint32_t crc, const void *bytes, size_t count)
{
    static const uint32_t of_nibble[16] = {
        0x00000000u, 0x1DB71064u, 0x3B6E20C8u, 0x26D930ACu, 0x76DC4190u, 0x6B6B51F4u, 0x4DB26158u, 0x5005713Cu,
        0xEDB88320u, 0xF00F9344u, 0xD6D6A3E8u, 0xCB61B38Cu, 0x9B64C2B0u, 0x86D3D2D4u, 0xA00AE278u, 0xBDBDF21Cu,
    };
    return crc_add(crc, bytes, count, of_nibble);
}

/* SPDX-License-Identifier: MIT */
#include "firmware/settings/crc16.h"

/* Half a byte at a time: 16 entries suffice. */
uint16_t crc16(const uint8_t *bytes, size_t count)
{
    static const uint16_t by_nibble[16] = {0x0000, 0xCC01, 0xD801, 0x1400, 0xF001, 0x3C00, 0x2800, 0xE401,
                                           0xA001, 0x6C00, 0x7800, 0xB401, 0x5000, 0x9C01, 0x8801, 0x4400};
    uint32_t crc = 0xFFFFu;
    for (size_t n = 0; n < count; n++) {
        crc ^= bytes[n];
        crc = (crc >> 4) ^ by_nibble[crc & 15u];
        crc = (crc >> 4) ^ by_nibble[crc & 15u];
    }
    return (uint16_t)crc;
}

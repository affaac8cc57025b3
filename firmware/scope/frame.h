/* SPDX-License-Identifier: MIT */
/*
 * A sample as bytes for a serial line, checked, and never mistaken for text:
 *
 *   0x01, then COBS of: kind, number (2 bytes), values, CRC (2 bytes); then 0x00
 *
 * `kind` is FRAME_SAMPLE plus the count of values, `number` counts milliseconds, modulo 2^16, lowest byte first. A value is
 * 1 to 5 bytes of 7 bits, lowest first, the top bit set if more follow, of (value << 1) ^ (value >> 31): small values of either
 * sign are short (the base-128 varint with zigzag of Protocol Buffers' encoding). The CRC is that of
 * Modbus (settings/crc.h) over what precedes it, lowest byte first. COBS: S. Cheshire, M. Baker, Consistent Overhead Byte
 * Stuffing, IEEE/ACM Transactions on Networking 7(2), 1999. Text has neither 0x00 nor 0x01, so both share a line.
 */
#ifndef FIRMWARE_SCOPE_FRAME_H
#define FIRMWARE_SCOPE_FRAME_H

#include <stdint.h>

#define FRAME_BEGIN  0x01u
#define FRAME_END    0x00u
#define FRAME_SAMPLE 0x50u /* 'P' */

#define FRAME_VALUES_MOST 8u
#define FRAME_BYTES_MOST  (1u + 1u + 3u + 5u * FRAME_VALUES_MOST + 2u + 1u)

/* Returns the bytes written, FRAME_BYTES_MOST at most. `count`: 1...FRAME_VALUES_MOST. Any context. */
uint32_t frame_sample(uint8_t *to, uint32_t number, const int32_t *values, uint32_t count);

#endif

/* SPDX-License-Identifier: MIT */
#include "firmware/scope/frame.h"

#define PLAIN_MOST (3u + 5u * FRAME_VALUES_MOST + 2u)

_Static_assert(PLAIN_MOST < 254u, "COBS: one byte more, however many zeros");

uint16_t frame_crc(const uint8_t *bytes, uint32_t count)
{
    static const uint16_t of_nibble[16] = {0x0000u, 0x1021u, 0x2042u, 0x3063u, 0x4084u, 0x50A5u, 0x60C6u, 0x70E7u,
                                           0x8108u, 0x9129u, 0xA14Au, 0xB16Bu, 0xC18Cu, 0xD1ADu, 0xE1CEu, 0xF1EFu};
    uint32_t crc = 0xFFFFu;
    for (uint32_t i = 0; i < count; i++) {
        crc = (crc << 4) ^ of_nibble[((crc >> 12) ^ ((uint32_t)bytes[i] >> 4)) & 15u];
        crc = (crc << 4) ^ of_nibble[((crc >> 12) ^ bytes[i]) & 15u];
    }
    return (uint16_t)crc;
}

static uint8_t *put_value(uint8_t *to, int32_t value)
{
    uint32_t rest = ((uint32_t)value << 1) ^ (value < 0 ? UINT32_MAX : 0u);
    while (rest > 127u) {
        *to++ = (uint8_t)(rest | 128u);
        rest >>= 7;
    }
    *to++ = (uint8_t)rest;
    return to;
}

/* Each zero becomes the distance to the next one, the first distance stands in front. */
static uint8_t *put_stuffed(uint8_t *to, const uint8_t *plain, uint32_t count)
{
    uint8_t *distance = to++;
    *distance = 1u;
    for (uint32_t i = 0; i < count; i++) {
        if (plain[i] == 0u) {
            distance = to++;
            *distance = 1u;
        } else {
            *to++ = plain[i];
            ++*distance;
        }
    }
    return to;
}

uint32_t frame_sample(uint8_t *to, uint32_t number, const int32_t *values, uint32_t count)
{
    uint8_t plain[PLAIN_MOST];
    uint8_t *end = plain;
    *end++ = (uint8_t)(FRAME_SAMPLE + count);
    *end++ = (uint8_t)number;
    *end++ = (uint8_t)(number >> 8);
    for (uint32_t i = 0; i < count; i++) {
        end = put_value(end, values[i]);
    }
    const uint16_t crc = frame_crc(plain, (uint32_t)(end - plain));
    *end++ = (uint8_t)crc;
    *end++ = (uint8_t)(crc >> 8);
    uint8_t *next = to;
    *next++ = FRAME_BEGIN;
    next = put_stuffed(next, plain, (uint32_t)(end - plain));
    *next++ = FRAME_END;
    return (uint32_t)(next - to);
}

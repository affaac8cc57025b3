/* SPDX-License-Identifier: MIT */
#include "firmware/scope/frame.h"

#include "firmware/settings/crc.h"

#define PLAIN_MOST (3u + 5u * FRAME_VALUES_MOST + 2u)

_Static_assert(PLAIN_MOST < 254u, "COBS: one byte more, however many zeros");

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
    const uint16_t crc = crc16(plain, (size_t)(end - plain));
    *end++ = (uint8_t)crc;
    *end++ = (uint8_t)(crc >> 8);
    uint8_t *next = to;
    *next++ = FRAME_BEGIN;
    next = put_stuffed(next, plain, (uint32_t)(end - plain));
    *next++ = FRAME_END;
    return (uint32_t)(next - to);
}

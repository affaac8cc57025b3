/* SPDX-License-Identifier: MIT */
/*
 * The console's machine-readable stream: frames of the scope's signals between the text, on the same line; commands work as
 * usual, and a terminal shows the frames as noise. It ends when no line has been received for STREAM_SILENCE_MS: an empty line
 * keeps it alive.
 */
#ifndef FIRMWARE_OPERATE_STREAM_H
#define FIRMWARE_OPERATE_STREAM_H

#include "firmware/operate/text.h"
#include "firmware/scope/scope.h"

#define STREAM_SILENCE_MS 3000u
#define STREAM_EVERY_MAX  1000 /* ms */

/* ---- a frame ---- */

/*
 * A sample as bytes for a serial line, with a check sum, and never mistaken for text:
 *
 *   0x01, then COBS of: kind, number (2 bytes), values, CRC (2 bytes); then 0x00
 *
 * `kind` is FRAME_SAMPLE plus the count of values, `number` counts milliseconds, modulo 2^16, lowest byte first. A value is
 * 1 to 5 bytes of 7 bits, lowest first, the top bit set if more follow, of (value << 1) ^ (value >> 31): small values of either
 * sign are short (the base-128 varint with zigzag of Protocol Buffers' encoding). The CRC is that of Modbus (settings/crc.h)
 * over what precedes it, lowest byte first. COBS: S. Cheshire, M. Baker, Consistent Overhead Byte Stuffing, IEEE/ACM
 * Transactions on Networking 7(2), 1999. Text has neither 0x00 nor 0x01, so both share a line.
 */
#define FRAME_BEGIN  0x01u
#define FRAME_END    0x00u
#define FRAME_SAMPLE 0x50u /* 'P' */

#define FRAME_VALUES_MAX 8u
#define FRAME_BYTES_MAX  (1u + 1u + 3u + 5u * FRAME_VALUES_MAX + 2u + 1u)

/* Returns the bytes written, FRAME_BYTES_MAX at most. `count`: 1...FRAME_VALUES_MAX. Any context. */
uint32_t frame_sample(uint8_t *to, uint32_t number, const int32_t *values, uint32_t count);

/* ---- frames on the line ---- */

struct stream {
    uint32_t every_ms;     /* 0: off */
    uint32_t next;         /* number of the recorder's sample to send next */
    uint32_t last_line_ms; /* when a line was last received */
    uint32_t baud;         /* the line's rate from the next poll on; 0: unchanged */
};

/* Starts with the next sample, every `every_ms`; the line's rate changes to `baud` after the present answer. Thread. */
void stream_begin(struct stream *s, const struct scope *scope, uint32_t every_ms, uint32_t baud);

/* Ends it; the console's own rate is back after the present answer. Thread. */
void stream_end(struct stream *s);

/* A line has been received. Thread. */
static inline void stream_keep_alive(struct stream *s, uint32_t now_ms)
{
    s->last_line_ms = now_ms;
}

/*
 * Sends what has been recorded since the last call. Frames that do not fit into the buffer are skipped, which shows in their
 * numbers. Waits only when the rate changes, until the buffer is empty. Thread.
 */
void stream_poll(struct stream *s, struct text *out, const struct scope *scope);

#endif

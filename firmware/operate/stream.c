/* SPDX-License-Identifier: MIT */
#include "firmware/operate/stream.h"

#include "firmware/settings/config.h"
#include "firmware/settings/crc.h"

/* ---- a frame ---- */

#define PLAIN_MAX (3u + 5u * FRAME_VALUES_MAX + 2u)

_Static_assert(PLAIN_MAX < 254u, "COBS: one byte more, however many zeros");

static uint8_t *put_varint(uint8_t *to, int32_t value)
{
    uint32_t rest = ((uint32_t)value << 1) ^ (value < 0 ? UINT32_MAX : 0u);
    while (rest > 127u) {
        *to++ = (uint8_t)(rest | 128u);
        rest >>= 7;
    }
    *to++ = (uint8_t)rest;
    return to;
}

/* COBS: each zero is replaced by the distance to the next one; the first distance leads. */
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
    uint8_t plain[PLAIN_MAX];
    uint8_t *end = plain;
    *end++ = (uint8_t)(FRAME_SAMPLE + count);
    *end++ = (uint8_t)number;
    *end++ = (uint8_t)(number >> 8);
    for (uint32_t i = 0; i < count; i++) {
        end = put_varint(end, values[i]);
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

/* ---- frames on the line ---- */

#define DRAIN_MS 200u /* a full buffer at 115200 baud takes 90 */

_Static_assert(FRAME_VALUES_MAX == SIGNALS_MAX, "a frame holds a sample");

void stream_begin(struct stream *s, const struct scope *scope, uint32_t every_ms, uint32_t baud)
{
    s->next = scope->recorder.count;
    s->last_line_ms = scope->axis->time_ms;
    s->every_ms = every_ms;
    s->baud = baud;
}

void stream_end(struct stream *s)
{
    if (s->every_ms != 0u) {
        s->every_ms = 0u;
        s->baud = CONFIG_CONSOLE_BAUD;
    }
}

/* When all pending output has been sent. */
static void change_rate(struct stream *s, struct text *out)
{
    const uint32_t begin_ms = *out->idle->time_ms;
    while (!mmuart_is_idle(out->uart) && *out->idle->time_ms - begin_ms < DRAIN_MS) {
        idle(out->idle);
    }
    (void)mmuart_init(out->uart, out->uart->regs, s->baud); /* the rate fits: the caller has checked it */
    s->baud = 0u;
}

static void send(struct text *out, uint32_t number, const int32_t *values, uint32_t count)
{
    uint8_t bytes[FRAME_BYTES_MAX];
    const uint32_t length = frame_sample(bytes, number, values, count);
    if (mmuart_free_space(out->uart) < length) {
        return;
    }
    for (uint32_t i = 0; i < length; i++) {
        (void)mmuart_put(out->uart, (char)bytes[i]);
    }
}

static void send_new(struct stream *s, struct text *out, const struct scope *scope)
{
    int32_t values[SIGNALS_MAX];
    const uint32_t now = scope->recorder.count;
    if ((int32_t)(now - s->next) > (int32_t)RECORDER_SAMPLES) {
        s->next = now - 1u; /* the thread was delayed for longer than the recorder stores */
    }
    for (; (int32_t)(now - s->next) > 0; s->next += s->every_ms) {
        if (recorder_get(&scope->recorder, s->next, scope->choice.count, values)) {
            send(out, s->next, values, scope->choice.count);
        }
    }
}

void stream_poll(struct stream *s, struct text *out, const struct scope *scope)
{
    const int32_t silent_ms = (int32_t)(scope->axis->time_ms - s->last_line_ms); /* two axes' clocks: may be -1 */
    if (s->every_ms != 0u && silent_ms > (int32_t)STREAM_SILENCE_MS) {
        stream_end(s);
    }
    if (s->baud != 0u) {
        change_rate(s, out);
    }
    if (s->every_ms != 0u) {
        send_new(s, out, scope);
    }
}

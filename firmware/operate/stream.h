/* SPDX-License-Identifier: MIT */
/*
 * The console's machine-readable mode: frames of the scope's signals (scope/frame.h) between the text. One line carries both,
 * commands work as usual, and a terminal shows the frames as noise. It ends by itself when no line has come for
 * STREAM_SILENCE_MS: an empty line keeps it alive.
 */
#ifndef FIRMWARE_OPERATE_STREAM_H
#define FIRMWARE_OPERATE_STREAM_H

#include "firmware/operate/text.h"
#include "firmware/scope/scope.h"

#define STREAM_SILENCE_MS 3000u
#define STREAM_EVERY_MOST 1000 /* ms */

struct stream {
    uint32_t every_ms; /* 0: off */
    uint32_t next;     /* number of the recorder's sample to send next */
    uint32_t heard_ms; /* when a line last came */
    uint32_t baud;     /* the line's rate from the next poll on; 0: unchanged */
};

/* Starts with the next sample, every `every_ms`; the line's rate changes to `baud` after the present answer. Thread. */
void stream_begin(struct stream *s, const struct scope *scope, uint32_t every_ms, uint32_t baud);

/* Ends it; the console's own rate is back after the present answer. Thread. */
void stream_end(struct stream *s);

/* A line has come. Thread. */
static inline void stream_hear(struct stream *s, uint32_t now_ms)
{
    s->heard_ms = now_ms;
}

/*
 * Sends what has been recorded since the last time, as far as there is room: skips what does not fit, whole frames at a time,
 * which shows in the frame numbers. Waits only when the rate changes, until all has been sent. Thread.
 */
void stream_poll(struct stream *s, struct text *out, const struct scope *scope);

#endif

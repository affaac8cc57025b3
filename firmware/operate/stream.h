/* SPDX-License-Identifier: MIT */
/*
 * The console's machine-readable mode: frames of the scope's signals (scope/frame.h) between the text, so that one line carries
 * both, commands work as ever, and a terminal shows what it does not know as noise. It ends by itself when nobody has sent a
 * line for STREAM_SILENCE_MS: an empty line keeps it up.
 */
#ifndef FIRMWARE_OPERATE_STREAM_H
#define FIRMWARE_OPERATE_STREAM_H

#include "firmware/operate/text.h"
#include "firmware/scope/scope.h"

#define STREAM_SILENCE_MS 3000u
#define STREAM_EVERY_MOST 1000 /* ms */

struct stream {
    uint32_t every_ms; /* 0: off */
    uint32_t next;     /* number of the recorder's sample that is sent next */
    uint32_t heard_ms; /* when a line last came */
    uint32_t baud;     /* the line's rate from the next poll on; 0: as it is */
};

/* From the next sample on, every so many milliseconds; at that rate of the line behind the present answer. Thread. */
void stream_begin(struct stream *s, const struct scope *scope, uint32_t every_ms, uint32_t baud);

/* Ends it, at the console's own rate again behind the present answer. Thread. */
void stream_end(struct stream *s);

/* A line has come. Thread. */
static inline void stream_hear(struct stream *s, uint32_t now_ms)
{
    s->heard_ms = now_ms;
}

/*
 * Sends what has been recorded since the last time, as far as there is room: what does not fit is left out, whole frames at a
 * time, and shows in the frames' numbers. Waits only where the rate changes: until all has been sent. Thread.
 */
void stream_poll(struct stream *s, struct text *out, const struct scope *scope);

#endif

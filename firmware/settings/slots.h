/* SPDX-License-Identifier: MIT */
/*
 * Two places for one set of settings, written in turn: while one is being written, the other holds the set before. What counts
 * is the whole slot with the later number (docs/settings.md).
 *
 * A slot is a page of its head and, behind it, pages of records. The head is written last, and its CRC is over everything: a
 * slot that a power cut left half written, in whatever order the bits took it, is no slot.
 */
#ifndef FIRMWARE_SETTINGS_SLOTS_H
#define FIRMWARE_SETTINGS_SLOTS_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/mss/envm.h"

#define SLOTS 2u

/* Where they lie: linker/ says. */
struct slots {
    const uint8_t *memory; /* as the core reads the first; the second follows it */
    uint32_t offset_bytes; /* of the first from the array's start */
    uint32_t slot_bytes;
};

enum slot_state {
    SLOT_EMPTY, /* never written: all bits alike */
    SLOT_DAMAGED,
    SLOT_WHOLE,
};

struct slots_view {
    enum slot_state state[SLOTS];
    uint32_t number[SLOTS];        /* of the save; counts up from 1, and on over 2^32 */
    uint32_t records_bytes[SLOTS]; /* whole pages */
    bool any;                      /* there is a whole one, */
    uint32_t newest;               /* which is this */
};

/* Looks at both. Thread; about 25 cycles a byte. */
struct slots_view slots_look(const struct slots *s);

/* The records of a slot that is whole. */
static inline const uint8_t *slots_records(const struct slots *s, uint32_t slot)
{
    return s->memory + slot * s->slot_bytes + ENVM_PAGE_BYTES;
}

/*
 * A slot being written, page after page. When slot_put() says that a page is full, the caller programs it, and goes on by
 * slot_next(); slot_pad() fills the last one; slot_head() makes the head of all that has been put.
 */
struct slot_writer {
    uint32_t page[ENVM_PAGE_WORDS];
    uint32_t page_offset; /* from the array's start: where this page belongs */
    uint32_t fill;        /* bytes of it */
    uint32_t slot;
    uint32_t head_offset, end_offset;
    uint32_t number;
    uint32_t records_bytes;
    uint32_t crc;
};

/* For the slot that is not the newest whole one. */
void slot_begin(struct slot_writer *w, const struct slots *s, const struct slots_view *view);

/* Whether so many more bytes have room. */
bool slot_has_room(const struct slot_writer *w, uint32_t bytes);

/* True when the page is full. */
bool slot_put(struct slot_writer *w, uint8_t byte);

void slot_next(struct slot_writer *w);

/* Fills the page with zeros; false if it is empty, and none is to be programmed. */
bool slot_pad(struct slot_writer *w);

void slot_head(struct slot_writer *w);

#endif

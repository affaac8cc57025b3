/* SPDX-License-Identifier: MIT */
/*
 * Two slots for one set of settings, written alternately: while one is being written, the other holds the previous set. The
 * valid slot with the higher number is used (docs/settings.md).
 *
 * A slot is a header page followed by pages of records. The header is written last, and its CRC covers everything: a slot left
 * incomplete by a power cut is invalid, whatever bits were programmed.
 */
#ifndef FIRMWARE_SETTINGS_SLOTS_H
#define FIRMWARE_SETTINGS_SLOTS_H

#include <stdbool.h>
#include <stdint.h>

#include "drivers/mss/envm.h"

#define SLOTS 2u

/* Their location, from linker/. */
struct slots {
    const uint8_t *memory; /* the first, as the core reads it; the second follows it */
    uint32_t offset_bytes; /* of the first from the array's start */
    uint32_t slot_bytes;
};

enum slot_state {
    SLOT_EMPTY, /* never written: all bits equal */
    SLOT_DAMAGED,
    SLOT_VALID,
};

struct slots_view {
    enum slot_state state[SLOTS];
    uint32_t number[SLOTS];        /* of the save; counts up from 1, wraps at 2^32 */
    uint32_t records_bytes[SLOTS]; /* whole pages */
    bool any;                      /* there is a valid slot; */
    uint32_t newest;               /* the newest */
};

/* Checks both. Thread; about 25 cycles a byte. */
struct slots_view slots_check(const struct slots *s);

/* The records of a valid slot. */
static inline const uint8_t *slots_records(const struct slots *s, uint32_t slot)
{
    return s->memory + slot * s->slot_bytes + ENVM_PAGE_BYTES;
}

/*
 * A slot being written, page by page. When slot_put() reports a full page, the caller programs it and calls slot_next();
 * slot_pad() fills the last one; slot_header() builds the header for everything put.
 */
struct slot_writer {
    uint32_t page[ENVM_PAGE_WORDS];
    uint32_t page_offset; /* of this page, from the array's start */
    uint32_t fill;        /* bytes in it */
    uint32_t slot;
    uint32_t header_offset, end_offset;
    uint32_t number;
    uint32_t records_bytes;
    uint32_t crc;
};

/* Begins the slot that does not hold the newest valid set. */
void slot_begin(struct slot_writer *w, const struct slots *s, const struct slots_view *view);

/* Whether this many more bytes fit. */
bool slot_has_room(const struct slot_writer *w, uint32_t bytes);

/* True when the page is full. */
bool slot_put(struct slot_writer *w, uint8_t byte);

void slot_next(struct slot_writer *w);

/* Fills the page with zeros; false if it is empty and is not to be programmed. */
bool slot_pad(struct slot_writer *w);

void slot_header(struct slot_writer *w);

/* ==== records ==== */

/*
 * A slot's contents: records with kind, name and value, so that a firmware can read those of other versions and skip unknown
 * records.
 *
 *     byte   0          kind; 0 is the end
 *            1          length of the name, RECORD_NAME_MAX at most
 *            2, 3       length of the value, low byte first
 *            4...       name, then value; whole numbers have their low byte first
 */
enum record_kind {
    RECORD_END,
    RECORD_PARAMETER, /* a number of 32 bits */
    RECORD_REACTION,  /* reaction to the fault of that name: one byte, enum reaction */
    RECORD_INDEX,     /* the field's angle at the encoder's index, 2^32 a turn */
    RECORD_COGGING,   /* harmonics of the shaft's torque, counted from the index: order, cos, sin, 32 bits each */
};

#define RECORD_HEADER_BYTES 4u
#define RECORD_NAME_MAX     31u

struct record {
    uint32_t kind; /* enum record_kind, or a later firmware's */
    char name[RECORD_NAME_MAX + 1u];
    const uint8_t *value;
    uint32_t value_bytes;
};

struct record_reader {
    const uint8_t *at, *end;
    bool broken; /* a length does not fit: another format */
};

static inline struct record_reader records_read(const uint8_t *records, uint32_t bytes)
{
    return (struct record_reader){records, records + bytes, false};
}

/* The next record; false at the end. */
bool record_next(struct record_reader *r, struct record *found);

/* The 32-bit word at an index of the value. */
int32_t record_word(const struct record *r, uint32_t place);

/* The header of a record. */
void record_header(uint8_t header[RECORD_HEADER_BYTES], uint32_t kind, const char *name, uint32_t value_bytes);

#endif

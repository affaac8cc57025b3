/* SPDX-License-Identifier: MIT */
/*
 * A slot's contents: records with kind, name and value, so one firmware version can read another's and skip what it does not
 * know.
 *
 *     byte   0          kind; 0 is the end
 *            1          length of the name, RECORD_NAME_MOST at most
 *            2, 3       length of the value, low byte first
 *            4...       name, then value; whole numbers have their low byte first
 */
#ifndef FIRMWARE_SETTINGS_RECORDS_H
#define FIRMWARE_SETTINGS_RECORDS_H

#include <stdbool.h>
#include <stdint.h>

enum record_kind {
    RECORD_END,
    RECORD_PARAMETER, /* a number of 32 bits */
    RECORD_REACTION,  /* reaction to the fault of that name: one byte, enum reaction */
    RECORD_INDEX,     /* the field's angle at the encoder's index, 2^32 a turn */
    RECORD_COGGING,   /* harmonics of the shaft's torque, counted from the index: order, cos, sin, 32 bits each */
};

#define RECORD_HEAD_BYTES 4u
#define RECORD_NAME_MOST  31u

struct record {
    uint32_t kind; /* enum record_kind, or a later firmware's */
    char name[RECORD_NAME_MOST + 1u];
    const uint8_t *value;
    uint32_t value_bytes;
};

struct record_reader {
    const uint8_t *at, *end;
    bool broken; /* a length does not fit: another format wrote it */
};

static inline struct record_reader records_read(const uint8_t *records, uint32_t bytes)
{
    return (struct record_reader){records, records + bytes, false};
}

/* The next record; false at the end. */
bool record_next(struct record_reader *r, struct record *found);

/* The 32-bit word at an index of the value. */
int32_t record_word(const struct record *r, uint32_t place);

/* The head of a record. */
void record_head(uint8_t head[RECORD_HEAD_BYTES], uint32_t kind, const char *name, uint32_t value_bytes);

uint32_t record_name_bytes(const char *name);

/* True if two names are the same. */
bool record_name_is(const char *a, const char *b);

#endif

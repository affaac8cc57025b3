/* SPDX-License-Identifier: MIT */
/*
 * The electronic data sheet of this image (CiA 306): the text of `make eds`, which the build packs
 * (firmware/tables/eds_packed.py) and this unpacks, a character at a time. Packed it is bits, the highest of each byte first,
 * one of these behind the other:
 *
 *     0, 0, 4 bits            one of the sixteen most frequent characters
 *     0, 1, 7 bits            any other
 *     1, 10 bits d, 6 bits n  n + 3 characters more, each as the one that came d + 1 before it
 */
#ifndef FIRMWARE_OPERATE_DATA_SHEET_H
#define FIRMWARE_OPERATE_DATA_SHEET_H

#include <stdint.h>

#define DATA_SHEET_WINDOW 1024u

struct data_sheet {
    uint32_t bit;            /* the next one of the packed text */
    uint32_t distance, left; /* of the characters that are being repeated */
    uint32_t place;          /* characters so far: the next one goes there, around the window */
    uint8_t recent[DATA_SHEET_WINDOW];
};

/* Characters of the whole text. */
uint32_t data_sheet_length(void);

/* From the first character again, whatever was read before. Thread. */
void data_sheet_begin(struct data_sheet *s);

/* The next character; of no more than data_sheet_length(). Thread. */
uint8_t data_sheet_next(struct data_sheet *s);

#endif

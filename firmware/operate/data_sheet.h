/* SPDX-License-Identifier: MIT */
/*
 * The electronic data sheet of this image (CiA 306): the text of `make eds`, which the build packs (tests/tools/eds_packed.py)
 * and this unpacks, a character at a time. Packed it is bits, the highest of each byte first, one of these behind the other:
 *
 *     0, 7 bits              a character
 *     1, 8 bits d, 6 bits n  n + 3 characters more, each as the one that came d + 1 before it
 */
#ifndef FIRMWARE_OPERATE_DATA_SHEET_H
#define FIRMWARE_OPERATE_DATA_SHEET_H

#include <stdint.h>

#define DATA_SHEET_WINDOW 256u /* an 8-bit place runs around in it */

struct data_sheet {
    uint32_t bit;           /* the next one of the packed text */
    uint8_t distance, left; /* of the characters that are being repeated */
    uint8_t place;          /* where the next one goes */
    uint8_t recent[DATA_SHEET_WINDOW];
};

/* Characters of the whole text. */
uint32_t data_sheet_length(void);

/* From the first character again, whatever was read before. Thread. */
void data_sheet_begin(struct data_sheet *s);

/* The next character; of no more than data_sheet_length(). Thread. */
uint8_t data_sheet_next(struct data_sheet *s);

#endif

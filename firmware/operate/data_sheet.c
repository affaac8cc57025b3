/* SPDX-License-Identifier: MIT */
#include "firmware/operate/data_sheet.h"

#include "data_sheet_text.h"

#define FREQUENT_BITS  4u
#define CHARACTER_BITS 7u
#define DISTANCE_BITS  10u
#define COUNT_BITS     6u
#define LEAST          3u

static uint32_t take_bits(struct data_sheet *s, uint32_t count)
{
    uint32_t value = 0;
    for (uint32_t n = 0; n < count; n++) {
        value = value << 1 | (packed[s->bit / 8u] >> (7u - s->bit % 8u) & 1u);
        s->bit++;
    }
    return value;
}

uint32_t data_sheet_length(void)
{
    return TEXT_BYTES;
}

void data_sheet_begin(struct data_sheet *s)
{
    s->bit = 0u;
    s->left = 0u; /* `place` may be anywhere: what is repeated came since */
}

static uint8_t spelled_character(struct data_sheet *s)
{
    return take_bits(s, 1u) == 0u ? frequent[take_bits(s, FREQUENT_BITS)] : (uint8_t)take_bits(s, CHARACTER_BITS);
}

uint8_t data_sheet_next(struct data_sheet *s)
{
    uint8_t character;
    if (s->left == 0u && take_bits(s, 1u) == 0u) {
        character = spelled_character(s);
    } else {
        if (s->left == 0u) {
            s->distance = take_bits(s, DISTANCE_BITS);
            s->left = take_bits(s, COUNT_BITS) + LEAST;
        }
        character = s->recent[(s->place - s->distance - 1u) % DATA_SHEET_WINDOW];
        s->left--;
    }
    s->recent[s->place++ % DATA_SHEET_WINDOW] = character;
    return character;
}

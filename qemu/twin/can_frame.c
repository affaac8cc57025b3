/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "can_frame.h"

#define CRC_BITS  15
#define CRC_POLY  0x4599u
#define TAIL_BITS 13 /* delimiter, acknowledge and its delimiter, seven of the end, three of the pause */
#define RUN       5  /* equal bits, behind which one of the other kind is stuffed */

struct wire {
    unsigned bits, run;
    bool last;
    uint32_t crc;
};

static void put_bit(struct wire *w, bool bit)
{
    w->crc = (w->crc << 1) ^ (bit != ((w->crc >> (CRC_BITS - 1)) & 1u) ? CRC_POLY : 0);
    w->crc &= (1u << CRC_BITS) - 1;
    w->run = w->bits && bit == w->last ? w->run + 1 : 1;
    w->last = bit;
    w->bits++;
    if (w->run == RUN) {
        w->last = !bit;
        w->run = 1;
        w->bits++;
    }
}

static void put_bits(struct wire *w, uint32_t value, unsigned bits)
{
    while (bits-- > 0) {
        put_bit(w, (value >> bits) & 1u);
    }
}

unsigned can_frame_bits(const struct can_frame *f)
{
    struct wire w = {0};
    put_bits(&w, 0, 1);
    if (f->extended) {
        put_bits(&w, f->id >> 18, 11);
        put_bits(&w, 3, 2); /* in place of RTR; IDE */
        put_bits(&w, f->id & 0x3FFFF, 18);
        put_bits(&w, f->remote, 1);
        put_bits(&w, 0, 2);
    } else {
        put_bits(&w, f->id, 11);
        put_bits(&w, f->remote, 1);
        put_bits(&w, 0, 2);
    }
    put_bits(&w, f->count, 4);
    for (unsigned n = 0; n < f->count && !f->remote; n++) {
        put_bits(&w, f->data[n], 8);
    }
    put_bits(&w, w.crc, CRC_BITS);
    return w.bits + TAIL_BITS;
}

uint32_t can_frame_rank(const struct can_frame *f)
{
    if (f->extended) {
        return (f->id >> 18) << 21 | 3u << 19 | (f->id & 0x3FFFF) << 1 | f->remote;
    }
    return f->id << 21 | (uint32_t)f->remote << 20;
}

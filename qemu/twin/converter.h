/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A serial converter at its pins, of the kind that the RTL reads (drivers/fabric/rtl/adc_spi.v): CS falling samples and brings
 * a zero, each falling edge of SCLK the next bit, MSB first. AD7356 (Analog Devices, Rev. A, page 18): two leading zeros;
 * AD7476A (Rev. F, page 7): four. 12 bits both. */
#ifndef TWIN_CONVERTER_H
#define TWIN_CONVERTER_H

#include <stdbool.h>
#include <stdint.h>

enum { AD7356_ZEROS = 2, AD7476A_ZEROS = 4 };

struct converter {
    uint32_t code; /* what CS falling takes; may come later if no bit of it has left yet */
    unsigned falls;
    bool cs_n, sclk;
};

/* The pins as they are now; returns the data line. */
static inline bool converter_follow(struct converter *c, unsigned zeros, bool cs_n, bool sclk)
{
    c->falls = cs_n ? 0 : c->falls + (c->sclk && !sclk);
    c->cs_n = cs_n;
    c->sclk = sclk;
    bool shifts = !cs_n && c->falls >= zeros && c->falls < zeros + 12;
    return shifts && (c->code >> (zeros + 11 - c->falls)) & 1;
}

#endif

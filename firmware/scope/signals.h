/* SPDX-License-Identifier: MIT */
/*
 * The signals of a running drive: one table of names, with each signal's location and scale. A signal is one word of the axis
 * or of its fabric, or the sum of two (an angle and its offset), and is copied raw: it is scaled when read.
 */
#ifndef FIRMWARE_SCOPE_SIGNALS_H
#define FIRMWARE_SCOPE_SIGNALS_H

#include <stddef.h>
#include <stdint.h>

#include "firmware/drive/drive.h"

#define SIGNALS_MAX 8u /* at a time */

enum signal_format {
    SIGNAL_CURRENT,   /* Q15 of i_range: A */
    SIGNAL_VOLTAGE,   /* Q15 of v_range: V */
    SIGNAL_STEPS,     /* steps of the loop's voltage: % of the bus */
    SIGNAL_ANGLE,     /* 2^32 is a turn: degrees, -180...180 */
    SIGNAL_FREQUENCY, /* 2^32 is a turn a sample: Hz */
    SIGNAL_RPM_Q4,    /* rpm */
    SIGNAL_RPM_Q16,   /* rpm */
    SIGNAL_COUNTS,    /* of the encoder */
    SIGNAL_NUMBER,    /* a number without a unit, bits, or a state */
    SIGNAL_KELVIN_Q4, /* degC */
    SIGNAL_WORD       /* of RAM, whatever it means: in thousandths, so that a level reaches all its bits */
};

struct signal_info {
    const char *name;
    enum signal_format format;
    uint16_t offset; /* bytes, into the axis or its fabric */
    uint16_t added;  /* of the word to add; 0: none */
    bool of_fabric;
    bool directed; /* its sign follows the operator's direction (axis_forward()), not the machine's */
};

/* A word that need not be aligned: one load all the same. */
typedef const volatile int32_t __attribute__((aligned(1))) signal_word;

/* Addresses of a signal. `added` is never NULL: it may point to a word that is 0. */
struct signal_source {
    signal_word *word;
    const volatile int32_t *added;
};

/* Chosen signals: rows of signal_table, or addresses of words of RAM, which need not be aligned. */
struct signal_choice {
    uint32_t count; /* 1...SIGNALS_MAX */
    uint32_t which[SIGNALS_MAX];
};

/* A value in thousandths of its unit is raw * milli / per; `milli` is negative where the sign is inverted. */
struct signal_scale {
    int32_t milli;
    uint32_t per;
};

extern const struct signal_info signal_table[];
extern const size_t signal_count;

/* Of a row or an address. Any context. */
const struct signal_info *signal_of(uint32_t which);

/*
 * The row of the name of `length` characters at `name`, or the address that "@2000a1bc" or "@a1bc" is; signal_count if it is
 * neither. Thread.
 */
uint32_t signal_find(const char *name, size_t length);

/* `zero`: a word that stays 0. Thread. */
struct signal_source signal_source(uint32_t which, const struct axis *a, const int32_t *zero);

/* With the present ranges. Thread. */
struct signal_scale signal_scale(const struct signal_info *info, const struct axis *a);

/* "A", "rpm", ... Any context. */
const char *signal_unit(enum signal_format format);

/* To thousandths of the unit and back, rounded to the nearest, halves away from zero, saturated to 32 bits. Thread. */
int32_t signal_milli(struct signal_scale scale, int32_t raw);
int32_t signal_raw(struct signal_scale scale, int32_t milli);

/* The default choice, useful after most faults. Thread. */
struct signal_choice signal_default(void);

/* Copies `count` signals, about 11 cycles each. ISR, slow loop. */
static inline __attribute__((always_inline)) void signals_copy(const struct signal_source *from, uint32_t count,
                                                               int32_t *to)
{
    for (const struct signal_source *const end = from + count; from != end; from++) {
        *to++ = (int32_t)((uint32_t)*from->word + (uint32_t)*from->added);
    }
}

#endif

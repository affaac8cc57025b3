/* SPDX-License-Identifier: MIT */
/*
 * Whether samples are a tone, and which: x0 + x2 = c x1 holds for every x = A cos(w n + p), with c = 2 cos w. Least squares
 * give c, and what is left over says how little of the samples is a tone (Prony's method for one frequency).
 */
#ifndef FIRMWARE_CONTROL_TONE_H
#define FIRMWARE_CONTROL_TONE_H

#include <stdint.h>

struct tone {
    int32_t before[2];               /* the last two samples, latest first */
    int64_t squares, products, sums; /* of x1 x1, (x0 + x2) x1, (x0 + x2)^2 */
};

struct tone_found {
    int32_t c_q13;    /* 2 cos of the angle from sample to sample */
    int32_t rest_q13; /* what is no tone, by the samples' squares: 0 for a tone, some 2.0 for white noise */
};

/* Range: |x| < 2^15, up to 64 samples. */
static inline void tone_add(struct tone *t, int32_t x)
{
    const int32_t at = t->before[0];
    const int32_t around = x + t->before[1];
    t->squares += at * at;
    t->products += (int64_t)around * at;
    t->sums += (int64_t)around * around;
    t->before[1] = at;
    t->before[0] = x;
}

/* Begins a block of samples: those before it stay known. */
static inline void tone_next(struct tone *t)
{
    *t = (struct tone){.before = {t->before[0], t->before[1]}};
}

/* Silence is no tone. Some hundred cycles. */
struct tone_found tone_find(const struct tone *t);

/* The frequency of `c`, at so many samples a second; as sampled, so below half of that. */
int32_t tone_hz(int32_t c_q13, int32_t sample_hz);

#endif

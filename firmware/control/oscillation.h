/* SPDX-License-Identifier: MIT */
/*
 * Finds that the speed loop oscillates with its shaft, and by how much its gains are too large. Slow loop, once a millisecond.
 *
 * Seen is the proportional part of the torque demand, in blocks of 16 ms: a tone above OSCILLATION_HZ, well above what the loop
 * is to follow, of more than a quarter of i_max, that does not fade. It was there in the block before, if it meets the torque
 * limit; in two, if it is not the first, or lies to one side as a step's answer does. A ramp and a reversal are no tone of such
 * a frequency; the answer to a step, or a light rotor's to the end of a ramp, is over in a block or two; cogging and ripple
 * are below a tenth of i_max, and half an edge
 * a millisecond below edge_q12. What swings faster than 500 Hz is seen folded below it, and acts there.
 *
 * A swing that has met the torque limit may be no tone any more: what the limit leaves of it beats with the samples. So what
 * swings that far, that fast, for HARD_BLOCKS needs no purity, where edges of the encoder cannot be what is seen.
 *
 * A loop that oscillates against its torque limit says how far it is from where it would not: the limit passes 4 / (pi A) of
 * a swing A times as large (the relay experiment of Astrom and Hagglund, Automatica 20(5), 1984, the other way round). Half of
 * that gain is taken: 6 dB of margin.
 *
 * But a coupling has a frequency of its own, and a notch there leaves more: so the first time the loop lets go of the shaft for
 * LISTEN_MS, and listens. A shaft that rings says its frequency; one that does not is lighter than was told, or on a
 * coupling too soft to be filtered.
 */
#ifndef FIRMWARE_CONTROL_OSCILLATION_H
#define FIRMWARE_CONTROL_OSCILLATION_H

#include <stdbool.h>
#include <stdint.h>

/* ==== a tone ==== */

/*
 * Whether samples are a tone, and which: x0 + x2 = c x1 holds for every x = A cos(w n + p), with c = 2 cos w. Least squares
 * give c, and what is left over says how little of the samples is a tone (Prony's method for one frequency).
 */

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

#define OSCILLATION_HZ 80
#define OSCILLATION_LISTEN_SHIFT \
    3 /* a shaft that nobody holds drifts: what is seen then has fewer bits, and more range */
#define OSCILLATION_ANSWERS_MOST 8u /* until the next switch-on: beyond it lower gains do not help */

enum oscillation_verdict {
    OSCILLATION_NOTHING,
    OSCILLATION_LET_GO, /* hold the mean torque and ask for nothing else while it listens */
    OSCILLATION_LESS,   /* go on with `share` of the gains, from the mean torque */
    OSCILLATION_NOTCH,  /* the same, and with a notch at `ring` */
};

struct oscillation {
    bool only_counts;   /* reduces nothing: a reaction was chosen that ends operation */
    bool listened;      /* once is enough until the next switch-on */
    uint32_t found;     /* how often; 0 at the next switch-on */
    uint32_t answered;  /* how often something was reduced for it */
    int32_t hz;         /* of the last */
    int32_t share_q15;  /* of the gains */
    int32_t ring_c_q13; /* 2 cos w of a shaft that rings by itself */
    int32_t edge_q12;   /* the proportional part of half an edge a millisecond */
    bool light;         /* it does not ring at all: its inertia is less than was told */
    struct tone tone;
    uint32_t steps;                       /* of the block, or since it listens */
    uint32_t blocks;                      /* since the gains last changed */
    uint32_t hard_blocks;                 /* in a row, of a swing near the torque limit */
    uint32_t level_q24[2];                /* mean squares of the last blocks, latest first */
    int32_t demand_sum_q15, seen_sum_q12; /* of the block so far */
    int32_t mean_q15;                     /* demand, over the last whole block */
    bool listens;
    int32_t seen_q12; /* the last, while it listens */
};

/* Forgets all. At switch-on. */
void oscillation_init(struct oscillation *o);

/* Starts anew with the samples; what was found stays. */
void oscillation_reset(struct oscillation *o);

/* What the speed does now says nothing else: it listens, or has just changed something. Slow loop. */
bool oscillation_is_answered(const struct oscillation *o);

/* One step: the proportional part and the whole demand, limited; the former in Q9 while it listens. */
enum oscillation_verdict oscillation_step(struct oscillation *o, int32_t seen_q12, int32_t demand_q15,
                                          int32_t i_max_q15);

#endif

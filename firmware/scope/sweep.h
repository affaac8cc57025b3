/* SPDX-License-Identifier: MIT */
/*
 * Frequency responses of the running drive: sines of increasing frequency are injected into a loop, and its response is
 * correlated with them.
 *
 *   d, q    the sine is in the current's reference r, the response is the current i. Both are taken as the handler used
 *           them, so it does not matter that the slow loop's references replace the sine for a sample each millisecond
 *   speed   the sine is a torque p added to the controller's u. The response is -u: the open loop is the same from
 *           wherever it is excited
 *
 * The result is the closed loop T = i / r, or -u / p; the open one is L = T / (1 - T). So |L| = 1 where Re T = 1/2, with the
 * phase margin 180 degrees - 2 atan |2 Im T|; T lags by 90 degrees where Re T = 0.
 *
 * The currents' sine is added in the sampler's interrupt (scope.h), right after the current loop's, for the next sample. The
 * current loop's handler is not changed, and without a sweep takes no longer.
 *
 * Each measurement has a whole number of periods, so that DC and the other frequencies cancel.
 */
#ifndef FIRMWARE_SCOPE_SWEEP_H
#define FIRMWARE_SCOPE_SWEEP_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/drive/drive.h"
#include "firmware/settings/error.h"

#define SWEEP_POINTS   32u
#define SWEEP_SHARE    8 /* of i_max_ma: the largest amplitude; above it the current limits distort the response */
#define SWEEP_UNITY    16384
#define SWEEP_HIGH_PCT 45u /* of the sampling rate: the highest frequency */

enum sweep_loop { SWEEP_D, SWEEP_Q, SWEEP_SPEED };

enum sweep_state { SWEEP_NONE, SWEEP_RUNS, SWEEP_DONE, SWEEP_ENDED };

struct sweep_complex {
    int64_t re, im;
};

struct sweep_point {
    int32_t millihertz;
    int32_t re_q14, im_q14; /* T */
};

struct sweep {
    struct axis *axis;
    volatile uint32_t state; /* enum sweep_state; the thread's */
    enum sweep_loop loop;
    int32_t amplitude_q15;
    uint32_t rate_hz;
    uint32_t count; /* points measured so far */
    struct sweep_point points[SWEEP_POINTS];
    uint32_t nominal_mhz; /* the present frequency, before rounding to whole periods */
    /* written by the interrupt while it runs, at the loop's rate */
    uint32_t step_q32, phase_q32;
    uint32_t settle;
    volatile uint32_t left; /* samples to come; at 0 the thread evaluates */
    uint32_t samples, periods;
    int32_t cos_q15, sin_q15; /* of the present sample */
    int32_t base_q15;         /* the reference without the sine */
    int32_t written_q15;      /* with it, as last written; another value is a new reference */
    struct sweep_complex probe, response;
};

/* True during a sweep. Any context. */
static inline bool sweep_runs(const struct sweep *s)
{
    return s->state == SWEEP_RUNS;
}

/* Begins; refused with the largest amplitude if that is too large. For d and q the caller then diverts the interrupt. */
struct outcome sweep_begin(struct sweep *s, enum sweep_loop loop, int32_t milliamp);

/* Ends it: the points measured so far stay. Thread. */
void sweep_end(struct sweep *s);

/* Evaluates a measured point and continues at the next frequency; false if none is ready. Thread, repeatedly. */
bool sweep_poll(struct sweep *s);

/* A sample of the currents, `samples` after the last one. The sampler's interrupt. */
void sweep_sample(struct sweep *s, uint32_t samples);

/* A step of the speed loop. Slow loop, last. */
void sweep_step(struct sweep *s);

/* Characteristic frequencies; 0: not within the points. */
struct sweep_summary {
    int32_t crossover_mhz, margin_ddeg; /* tenths of a degree */
    int32_t lag_mhz;                    /* T at -90 degrees */
    int32_t bandwidth_mhz;              /* T at -3 dB */
};

struct sweep_summary sweep_summary(const struct sweep *s);

#endif

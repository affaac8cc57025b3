/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The modulator and the streams of three: bit by bit against whole numbers, their mean against the input, full scale against
 * the data sheet, and what a sinc3 filter leaves of their noise against theory. */
#include <math.h>
#include <stdio.h>

#include "bench.h"
#include "bit_streams.h"
#include "check.h"
#include "modulator.h"

#define SCALE  4096 /* inputs are whole numbers of it, so that a double holds everything exactly */
#define LINEAR (SCALE * 25 / 32)

/* ---- one modulator ---- */

/* The same loop in whole numbers. */
static int exact_bit(int64_t integral[2], int bit, int64_t input)
{
    int64_t back = bit ? SCALE : -SCALE;
    integral[0] += input - back;
    integral[1] += integral[0] - back;
    return integral[1] >= 0;
}

static void bits_and_mean(void)
{
    int wrong = 0;
    double worst = 0;
    for (int run = 0; run < 200; run++) {
        struct modulator m = {0};
        int64_t input = run == 0 ? 0 : any_between(-LINEAR, LINEAR), integral[2] = {0, 0}, ones = 0;
        int bit = 0, count = any_between(1, 4000);
        for (int n = 0; n < count; n++) {
            bit = exact_bit(integral, bit, input);
            wrong += modulator_clock(&m, (double)input / SCALE) != (bool)bit;
            ones += bit;
        }
        double mean = (2.0 * (double)ones - count) / count;
        worst = fmax(worst, fabs(mean - (double)input / SCALE) * count);
    }
    check_equal("modulator: every bit is that of exact arithmetic, 200 levels", wrong, 0);
    check_between("modulator: the mean of n bits is the input within 6 / n", worst, 0.5, 6);
}

static double density(double millivolts, int count)
{
    struct modulator m = {0};
    int ones = 0;
    for (int n = 0; n < count; n++) {
        ones += modulator_clock(&m, millivolts / 320);
    }
    return (double)ones / count;
}

static void data_sheet(void)
{
    check_near("SBAS734: 50 % ones at 0 V", density(0, 100000), 0.5, 1e-4);
    check_near("SBAS734: 89.06 % at 250 mV", density(250, 100000), 0.8906, 1e-4);
    check_near("SBAS734: 10.94 % at -250 mV", density(-250, 100000), 0.1094, 1e-4);
    check_near("SBAS734: at 320 mV a zero in 128", density(320, 12800), 127.0 / 128, 1e-9);
    check_near("SBAS734: at -400 mV a one in 128", density(-400, 12800), 1.0 / 128, 1e-9);
    struct modulator m = {0};
    int ones = 0;
    for (int n = 0; n < 3000; n++) {
        bool bit = modulator_clock(&m, n < 1000 ? 2 : 0.25);
        ones += n >= 1100 && bit;
    }
    check_near("after full scale it works as before", ones / 1900.0, 0.625, 5e-3);
}

/* ---- behind a sinc3 filter ---- */

#define TAPS_MOST (3 * 256)

static int make_taps(int osr, double taps[TAPS_MOST])
{
    int length = 1;
    taps[0] = 1;
    for (int stage = 0; stage < 3; stage++) {
        double sum[TAPS_MOST] = {0};
        for (int n = 0; n < length; n++) {
            for (int k = 0; k < osr; k++) {
                sum[n + k] += taps[n] / osr;
            }
        }
        length += osr - 1;
        for (int n = 0; n < length; n++) {
            taps[n] = sum[n];
        }
    }
    return length;
}

static struct stretch constant(double level)
{
    return (struct stretch){.from_ps = 0, .to_ps = 1e12, .from = {level, level, level}, .to = {level, level, level}};
}

/* RMS error of single results, over levels, each preceded by a time of its own. */
static double rms_of_results(int osr, double noise)
{
    enum { LEVELS = 60, RESULTS = 40 };
    double taps[TAPS_MOST], sum = 0;
    int length = make_taps(osr, taps);
    static struct bit_streams s;
    for (int level = 0; level < LEVELS; level++) {
        double input = any_real(-0.7, 0.7), at_ps = 0;
        bit_streams_init(&s, noise, (uint64_t)level);
        struct stretch all = constant(input);
        bit_streams_follow(&s, &all);
        for (int warm = any_between(50, 150); warm > 0; warm--, at_ps += 50e3) {
            (void)bit_streams_clock(&s, at_ps);
        }
        for (int n = 0; n < RESULTS; n++) {
            double value = 0;
            for (int k = 0; k < length; k++, at_ps += 50e3) {
                value += taps[k] * ((bit_streams_clock(&s, at_ps) & 1u) ? 1 : -1);
            }
            sum += (value - input) * (value - input);
        }
    }
    return sqrt(sum / (LEVELS * RESULTS));
}

/* Quantisation noise of 1/3, white, leaves the loop by (1 - 1/z)^2, which takes two of the filter's three sums away: taps
 * of 1, -2, 1 over OSR bits each, by OSR cubed, 6 / OSR^5 in squares. One bit is overloaded now and then, which a constant
 * gain knows nothing of: by half as much again is usual. Of white noise at the input, the squares of the taps. */
static void noise(void)
{
    for (int osr = 16; osr <= 256; osr *= 2) {
        double taps[TAPS_MOST], squares = 0, quantised = sqrt(2 / pow(osr, 5)), white = 3e-3;
        int length = make_taps(osr, taps);
        for (int k = 0; k < length; k++) {
            squares += taps[k] * taps[k];
        }
        char name[80];
        snprintf(name, sizeof name, "sinc3 of %d bits: noise of the bits by theory", osr);
        double of_bits = rms_of_results(osr, 0);
        check_between(name, of_bits / quantised, 0.7, 2);
        snprintf(name, sizeof name, "sinc3 of %d bits: noise of the input by theory", osr);
        check_between(name, rms_of_results(osr, white) / hypot(white * sqrt(squares), of_bits), 0.9, 1.1);
    }
}

/* ---- streams ---- */

static void a_ramp(void)
{
    static struct bit_streams s;
    bit_streams_init(&s, 0, 1);
    /* up over 100 us in unequal steps, then away: what is listed is a straight line */
    double at_ps = 0;
    for (int n = 0; n < 40; n++) {
        double length_ps = n % 2 ? 4e6 : 1e6, from = at_ps / 100e6 - 0.5, to = (at_ps + length_ps) / 100e6 - 0.5;
        struct stretch part = {at_ps, at_ps + length_ps, {from, -from, 0.25}, {to, -to, 0.25}};
        bit_streams_follow(&s, &part);
        at_ps += length_ps;
    }
    double sum[3] = {0}, inputs = 0;
    for (int n = 0; n < 2000; n++) {
        unsigned bits = bit_streams_clock(&s, n * 50e3);
        for (int k = 0; k < 3; k++) {
            sum[k] += bits >> k & 1 ? 1 : -1;
        }
        inputs += n * 50e3 / 100e6 - 0.5;
    }
    check_near("streams: A is the ramp's mean", sum[0], inputs, 6);
    check_near("streams: B its negative", sum[1], -inputs, 6);
    check_near("streams: C another level", sum[2], 0.25 * 2000, 6);
    check_true("streams: nothing was lost", !bit_streams_forgot(&s, 0));
    for (int n = 0; n < STRETCHES_ROOM + 5; n++) {
        struct stretch more = {at_ps, at_ps + 1e3, {0}, {0}};
        bit_streams_follow(&s, &more);
        at_ps += 1e3;
    }
    check_true("streams: too much of it is told", bit_streams_forgot(&s, 100e6) && !bit_streams_forgot(&s, at_ps));
}

static int differing(uint64_t seed, uint64_t other)
{
    static struct bit_streams s, t;
    bit_streams_init(&s, 1e-3, seed);
    bit_streams_init(&t, 1e-3, other);
    struct stretch all = constant(0.1);
    bit_streams_follow(&s, &all);
    bit_streams_follow(&t, &all);
    int different = 0;
    for (int n = 0; n < 5000; n++) {
        different += bit_streams_clock(&s, n * 50e3) != bit_streams_clock(&t, n * 50e3);
    }
    return different;
}

int main(void)
{
    bits_and_mean();
    data_sheet();
    noise();
    a_ramp();
    check_equal("streams: the same seed, the same bits", differing(7, 7), 0);
    check_true("streams: another seed, other bits", differing(7, 8) > 500);
    return check_end();
}

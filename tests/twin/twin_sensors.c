/* SPDX-License-Identifier: GPL-2.0-or-later */
/* From amperes and volts to codes. A range of 20.48 A makes one code 10 mA. */
#include "sensors.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "check.h"

static const struct sensor_params ideal = {
    .i_range_a = 20.48,
    .v_range_v = 40.96,
    .adc_bits = 12,
    .i_gain_a = 1,
    .i_gain_b = 1,
    .i_gain_c = 1,
    .encoder_counts = 4000,
};

static void sample(struct sensors *s, const double i_a[3], double bus_v, uint32_t code[4])
{
    sensors_draw_noise(s);
    for (int k = 0; k < 3; k++) {
        code[k] = sensors_current_code(s, k, 0, i_a[k]);
    }
    code[3] = sensors_bus_code(s, bus_v);
}

static void sample_of(const struct sensor_params *p, double a, double b, double c, double bus_v, uint32_t code[4])
{
    struct sensors s;
    sensors_init(&s, p, 1);
    sample(&s, (double[3]){a, b, c}, bus_v, code);
}

static void check_codes(const char *name, const uint32_t code[4], int64_t a, int64_t b, int64_t c, int64_t bus)
{
    char full[100];
    const int64_t expected[4] = {a, b, c, bus};
    for (int k = 0; k < 4; k++) {
        snprintf(full, sizeof full, "%s: %s", name, (const char *[]){"IA", "IB", "IC", "VBUS"}[k]);
        check_equal(full, code[k], expected[k]);
    }
}

static void scale(void)
{
    uint32_t code[4];
    sample_of(&ideal, 0, 0, 0, 0, code);
    check_codes("zero", code, 2048, 2048, 2048, 0);
    sample_of(&ideal, 1.00, -2.00, 10.24, 24, code);
    check_codes("scale", code, 2148, 1848, 3072, 2400);
    sample_of(&ideal, 0.0149, 0.0151, -0.0151, 0.0049, code);
    check_codes("rounds to the nearest", code, 2049, 2050, 2046, 0);
    sample_of(&ideal, 20.47, 20.48, 1e3, 1e3, code);
    check_codes("clips at the top", code, 4095, 4095, 4095, 4095);
    sample_of(&ideal, -20.48, -20.49, -1e3, -1, code);
    check_codes("clips at the bottom", code, 0, 0, 0, 0);

    struct sensor_params p = ideal;
    p.adc_bits = 10;
    sample_of(&p, 0.019, 0.021, 1e3, 40.95, code);
    check_codes("10 bits: the low two stay zero", code, 2048, 2052, 4092, 4092);
}

/* Over the whole range the code is never further than half a step from the truth. */
static void quantisation(void)
{
    double worst_lsb = 0, sum_lsb = 0;
    const int points = 20000;
    for (int n = 0; n < points; n++) {
        double lsb = any_real(-2048, 2047);
        uint32_t code[4];
        sample_of(&ideal, lsb * 0.01, 0, 0, 0, code);
        double error = code[0] - 2048.0 - lsb;
        worst_lsb = fmax(worst_lsb, fabs(error));
        sum_lsb += error;
    }
    check_between("quantisation: worst error (LSB)", worst_lsb, 0.49, 0.5 + 1e-9);
    /* uniform errors have a deviation of 0.289 LSB: 20000 of them, 0.002; four times that */
    check_near("quantisation: mean error (LSB)", sum_lsb / points, 0, 0.008);
}

static void errors_of_the_analogue_part(void)
{
    struct sensor_params p = ideal;
    uint32_t code[4];
    p.i_offset_a_lsb = 7;
    p.i_offset_b_lsb = -11;
    p.i_offset_c_lsb = 4;
    sample_of(&p, 1, 1, 1, 24, code);
    check_codes("offsets", code, 2155, 2137, 2152, 2400);
    p = ideal;
    p.i_gain_a = 1.1;
    p.i_gain_b = 0.5;
    p.i_gain_c = -1;
    sample_of(&p, 1, 1, 1, 24, code);
    check_codes("gains", code, 2158, 2098, 1948, 2400);

    struct sensors s;
    sensors_init(&s, &ideal, 1);
    s.current[0].add_a = 2;
    s.current[1].stuck_code = 99;
    sample(&s, (double[3]){1, 1, 1}, 24, code);
    check_codes("an added current and a stuck code", code, 2348, 99, 2148, 2400);
}

/* Mean and deviation of the codes; quantisation adds 1/12 LSB^2 to the variance of the noise. */
static void noise(void)
{
    struct sensor_params p = ideal;
    struct sensors s;
    const int count = 40000;
    double sum[4] = {0}, square[4] = {0}, cross = 0;
    p.i_noise_lsb = 3;
    p.v_noise_lsb = 1.5;
    sensors_init(&s, &p, 42);
    for (int n = 0; n < count; n++) {
        uint32_t code[4];
        sample(&s, (double[3]){0, 1, -1}, 24, code);
        const double middle[4] = {2048, 2148, 1948, 2400};
        for (int k = 0; k < 4; k++) {
            double d = code[k] - middle[k];
            sum[k] += d;
            square[k] += d * d;
        }
        cross += (code[0] - 2048.0) * (code[1] - 2148.0);
    }
    for (int k = 0; k < 4; k++) {
        double deviation = k < 3 ? 3 : 1.5, expected = sqrt(deviation * deviation + 1.0 / 12);
        /* four standard errors of a mean and of a deviation */
        check_near("noise: mean (LSB)", sum[k] / count, 0, 4 * expected / sqrt(count));
        check_near("noise: standard deviation (LSB)", sqrt(square[k] / count), expected,
                   4 * expected / sqrt(2.0 * count));
    }
    check_near("noise: channels are independent", cross / count / 9, 0, 4 / sqrt(count));
}

/* A Gaussian by its share within one, two and three deviations. */
static void gaussian(void)
{
    static const double share[3] = {0.682689, 0.954500, 0.997300};
    struct random r;
    const int count = 100000;
    int within[3] = {0};
    random_seed(&r, 7);
    for (int n = 0; n < count; n++) {
        double x = fabs(random_gaussian(&r));
        for (int k = 0; k < 3; k++) {
            within[k] += x < k + 1;
        }
    }
    for (int k = 0; k < 3; k++) {
        double deviation = sqrt(share[k] * (1 - share[k]) / count);
        check_near("Gaussian: share within 1, 2, 3 deviations", (double)within[k] / count, share[k], 4 * deviation);
    }
}

static void codes_of_seed(uint64_t seed, uint32_t codes[400])
{
    struct sensor_params p = ideal;
    struct sensors s;
    p.i_noise_lsb = p.v_noise_lsb = 2;
    sensors_init(&s, &p, seed);
    for (int n = 0; n < 100; n++) {
        sample(&s, (double[3]){0}, 24, codes + 4 * n);
    }
}

static void seeds(void)
{
    uint32_t first[400], second[400];
    codes_of_seed(5, first);
    codes_of_seed(5, second);
    check_equal("the same seed, the same codes", memcmp(first, second, sizeof first), 0);
    codes_of_seed(6, second);
    check_true("another seed, other codes", memcmp(first, second, sizeof first) != 0);
}

/* Streams of one seed: the product of two has the mean zero, unless one is the other, shifted or not. */
static void streams_of_one_seed(void)
{
    enum { STREAMS = 4, DRAWS = 4000, SHIFTS = 10 };
    static double drawn[STREAMS][DRAWS];
    for (int n = 0; n < STREAMS; n++) {
        struct random r;
        random_seed(&r, 12);
        if (n > 0) {
            random_seed_stream(&r, 12, (enum random_stream)n);
        }
        for (int k = 0; k < DRAWS; k++) {
            drawn[n][k] = random_gaussian(&r);
        }
    }
    double worst = 0;
    for (int pair = 0; pair < STREAMS * STREAMS; pair++) {
        const double *one = drawn[pair / STREAMS], *other = drawn[pair % STREAMS];
        for (int shift = 0; shift < SHIFTS && one != other; shift++) {
            double sum = 0;
            for (int k = 0; k + shift < DRAWS; k++) {
                sum += one[k] * other[k + shift];
            }
            worst = fmax(worst, fabs(sum) / DRAWS);
        }
    }
    check_near("correlation of two streams of a seed", worst, 0, 5 / sqrt(DRAWS));
}

int main(void)
{
    scale();
    quantisation();
    errors_of_the_analogue_part();
    noise();
    gaussian();
    seeds();
    streams_of_one_seed();
    return check_end();
}

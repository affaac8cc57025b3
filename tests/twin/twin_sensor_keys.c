/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Ranges of the sensors' keys and what they must not be together; at their defaults, nothing is in the way of the truth. */
#include <math.h>
#include <string.h>

#include "check.h"
#include "sensors.h"

static double *value_of(struct sensor_params *p, const struct config_key *k)
{
    return (double *)((char *)p + k->offset);
}

static struct sensor_params defaults(void)
{
    struct sensor_params p;
    for (const struct config_key *k = sensor_keys; k->name; k++) {
        *value_of(&p, k) = isnan(k->initial) ? 20.48 : k->initial;
    }
    return p;
}

static void all_keys(void)
{
    size_t count = 0;
    for (const struct config_key *k = sensor_keys; k->name; k++, count++) {
        bool in_range = isnan(k->initial) || (k->initial >= k->min && k->initial <= k->max);
        check_true(k->name, k->min < k->max && in_range && k->offset % sizeof(double) == 0);
    }
    check_equal("a key for each parameter", count * sizeof(double), sizeof(struct sensor_params));
}

static void neutral(void)
{
    struct sensor_params p = defaults();
    struct sensors s;
    check_true("defaults agree", sensor_conflict(&p) == NULL);
    sensors_init(&s, &p, 3);
    check_true("nothing to follow between samples", !s.follows);
    for (int n = 0; n < 20; n++) {
        double t_s = n * 7.0, i_a = n - 10.0;
        sensors_draw_noise(&s);
        for (int k = 0; k < 3; k++) {
            check_equal("the truth, at any time", sensors_current_code(&s, k, t_s, i_a), 2048 + 100 * (n - 10));
        }
        check_equal("edges of a turn", disc_edges(&s.disc, 6.283185307179587 * n + 1e-9), 4096 * n);
        check_equal("no miscounts", disc_miscounts(&s.disc, 4096), 0);
    }
}

static void conflict(const char *key, double value, const char *part)
{
    struct sensor_params p = defaults();
    for (const struct config_key *k = sensor_keys; k->name; k++) {
        if (strcmp(k->name, key) == 0) {
            *value_of(&p, k) = value;
        }
    }
    const char *message = sensor_conflict(&p);
    check_true(key, message && strstr(message, part) && !strchr(message, '\n'));
}

static void conflicts(void)
{
    conflict("adc_bits", 11.5, "whole");
    conflict("shunt", 0.5, "0 or 1");
    conflict("skew_b_s", 1.5e-6, "less than sensor.adc_conversion_s");
    conflict("skew_c_s", 1.9e-6, "less than sensor.adc_conversion_s");
    conflict("amp_hz", 10, "at least 1000");
    conflict("encoder_counts", 4000.5, "whole");
    conflict("encoder_index_counts", 1.5, "whole");
    conflict("encoder_index_counts", 4096, "less than sensor.encoder_counts");
    conflict("encoder_phase", -0.25, "0.25");
    conflict("encoder_asymmetry", 0.125, "0.25");
    conflict("encoder_lost_per_rev", 4097, "at most");
    conflict("encoder_extra_per_rev", 4097, "at most");
    struct sensor_params p = defaults();
    p.encoder_counts = 4001;
    check_true("an odd number of counts alone is no conflict", sensor_conflict(&p) == NULL);
    p.encoder_asymmetry = 0.01;
    check_true("but has no lines to be asymmetric", sensor_conflict(&p) != NULL);
}

int main(void)
{
    all_keys();
    neutral();
    conflicts();
    return check_end();
}

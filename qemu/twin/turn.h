/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Sine and cosine a little further on, without calling sin(): the steps keep x below 0.6, where these series are exact to
 * 1e-11, and the electrical angle below 0.1, where they are exact to double precision. */
#ifndef TWIN_TURN_H
#define TWIN_TURN_H

static inline void turn_by(double x, double sin_start, double cos_start, double *s, double *c)
{
    double xx = x * x;
    double sin_x = x * (1 - xx / 6 * (1 - xx / 20 * (1 - xx / 42 * (1 - xx / 72))));
    double cos_x = 1 - xx / 2 * (1 - xx / 12 * (1 - xx / 30 * (1 - xx / 56 * (1 - xx / 90))));
    *s = sin_start * cos_x + cos_start * sin_x;
    *c = cos_start * cos_x - sin_start * sin_x;
}

#endif

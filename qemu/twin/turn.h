/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Sine and cosine a little further on, without calling sin(): the steps keep x below 0.6, where these series are exact to
 * 1e-11, and the electrical angle below 0.1, where they are exact to double precision. */
#ifndef TWIN_TURN_H
#define TWIN_TURN_H

static inline void turn_by(double x, double sin_start, double cos_start, double *s, double *c)
{
    double xx = x * x;
    double sin_x = x + x * xx * (-1 / 6.0 + xx * (1 / 120.0 + xx * (-1 / 5040.0 + xx * (1 / 362880.0))));
    double cos_x = 1 + xx * (-0.5 + xx * (1 / 24.0 + xx * (-1 / 720.0 + xx * (1 / 40320.0 - xx * (1 / 3628800.0)))));
    *s = sin_start * cos_x + cos_start * sin_x;
    *c = cos_start * cos_x - sin_start * sin_x;
}

#endif

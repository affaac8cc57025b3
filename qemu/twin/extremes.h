/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Of two numbers. fmin() and fmax() also say what of a NaN, and are calls for that. */
#ifndef TWIN_EXTREMES_H
#define TWIN_EXTREMES_H

static inline double lesser(double a, double b)
{
    return a < b ? a : b;
}

static inline double larger(double a, double b)
{
    return a > b ? a : b;
}

#endif

/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "modulator.h"

#include <math.h>

/* Of the second integrator; at 25/32 of full scale it reaches (5 - u)^2 / (8 (1 - u)) = 10.2 (Schreier and Temes, 3.3). */
#define FIRST_MOST   4.0
#define SECOND_MOST  12.0
#define SIGN_OF_LIFE 128u

static double held(double value, double most)
{
    return fmin(fmax(value, -most), most);
}

static bool clip(struct modulator *m, bool above)
{
    m->first = m->second = 0;
    m->clipped = (m->clipped + 1) % SIGN_OF_LIFE;
    m->bit = above != (m->clipped == 0);
    return m->bit;
}

bool modulator_clock(struct modulator *m, double input)
{
    if (fabs(input) >= 1) {
        return clip(m, input > 0);
    }
    double back = m->bit ? 1 : -1;
    m->clipped = 0;
    m->first = held(m->first + input - back, FIRST_MOST);
    m->second = held(m->second + m->first - back, SECOND_MOST);
    m->bit = m->second >= 0;
    return m->bit;
}

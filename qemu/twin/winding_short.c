/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "winding_short.h"

#include <math.h>

#define LEAKAGE_SHARE  0.1  /* of a phase's inductance that does not link the other turns: assumed */
#define FASTEST_LOOP_S 2e-6 /* a faster loop is taken as this fast: the PWM shows no difference, and steps stay few */

double winding_short_loop_ohm(const struct winding_short *f, double phase_ohm)
{
    double mu = f->fraction;
    return f->r_ohm + mu * (1 - mu) * phase_ohm + mu * mu * phase_ohm / 3;
}

struct winding_short winding_short_at(int phase, double fraction, double r_ohm, double phase_ohm, double phase_h)
{
    struct winding_short f = {.present = true, .phase = phase, .fraction = fraction, .r_ohm = r_ohm};
    double leakage_h = fraction * fraction * LEAKAGE_SHARE * phase_h;
    f.loop_h = fmax(leakage_h, FASTEST_LOOP_S * winding_short_loop_ohm(&f, phase_ohm));
    f.loop_per_h = 1 / f.loop_h;
    return f;
}

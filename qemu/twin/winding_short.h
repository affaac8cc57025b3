/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Turns of one phase shorted over a resistance: a fraction mu of the phase carries the loop current i_f less.
 *
 *   phase:  v = R (i - mu i_f) + dpsi/dt        loop:  mu v = (R_s + mu (1-mu) R) i_f + L di_f/dt
 *
 * The air gap sees the current i - mu i_f of each phase, so the machine behind is the healthy one, and the fault draws
 * mu i_f beside it. v is the phase's voltage to the star point; the fault moves that point by -R mu i_f / 3, which the
 * terminals do not see. L is the leakage of the shorted turns. It only decides how fast the loop follows; steady currents
 * do not depend on it. */
#ifndef TWIN_WINDING_SHORT_H
#define TWIN_WINDING_SHORT_H

#include <stdbool.h>

struct winding_short {
    bool present;
    int phase;
    double fraction;   /* mu */
    double r_ohm;      /* R_s */
    double loop_h;     /* L */
    double loop_per_h; /* 1 / L; 0 without a short */
};

/* In the machine's phase of this resistance and inductance. */
struct winding_short winding_short_at(int phase, double fraction, double r_ohm, double phase_ohm, double phase_h);
/* What the loop current meets, driven by mu times the voltage that the terminals impose on the phase. */
double winding_short_loop_ohm(const struct winding_short *f, double phase_ohm);

#endif

/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "slots.h"

#include <string.h>

enum { XX, QQ, XQQ, Q4, XQ, Q3 }; /* in the order of the keys; the last two go with the sine */

static const double order_of[SLOT_ORDERS] = {6, 12, 18, 36};

void slots_init(struct slots *s, const struct motor_params *p)
{
    const double *keys = &p->slots6_xx;
    memset(s, 0, sizeof *s);
    for (int n = 0; n < SLOT_ORDERS; n++) {
        for (int f = 0; f < SLOT_FORMS; f++) {
            s->c[n][f] = keys[SLOT_FORMS * n + f];
            s->steepest[f] += fabs(s->c[n][f]);
            s->present = s->present || s->c[n][f] != 0;
        }
    }
}

void slots_turn(const struct slots *s, const double cos_k[3], const double sin_k[3], struct slots_angle *a)
{
    memset(a, 0, sizeof *a);
    for (int n = 0; n < SLOT_ORDERS; n++) {
        bool last = n == SLOT_ORDERS - 1;
        double cn = last ? cos_k[2] * cos_k[2] - sin_k[2] * sin_k[2] : cos_k[n];
        double sn = last ? 2 * cos_k[2] * sin_k[2] : sin_k[n];
        for (int f = 0; f < SLOT_FORMS; f++) {
            a->now[f] += s->c[n][f] * (f < XQ ? cn : sn);
            a->turn[f] += s->c[n][f] * order_of[n] * (f < XQ ? -sn : cn);
        }
    }
}

static inline double energy(const double k[SLOT_FORMS], double x, double q)
{
    return k[XX] * x * x + (k[QQ] + k[XQQ] * x + k[Q4] * q * q) * q * q + (k[XQ] * x + k[Q3] * q * q) * q;
}

/* 2/3 of the energy's derivatives. */
static inline struct dq current(const double k[SLOT_FORMS], double x, double q)
{
    double d = 2 * k[XX] * x + k[XQQ] * q * q + k[XQ] * q;
    double by_q = 2 * (k[QQ] + k[XQQ] * x) * q + 4 * k[Q4] * q * q * q + k[XQ] * x + 3 * k[Q3] * q * q;
    return (struct dq){d / 1.5, by_q / 1.5};
}

void slots_at(const struct slots_angle *a, double x, double q, struct slots_point *at)
{
    *at = (struct slots_point){energy(a->now, x, q), energy(a->turn, x, q), current(a->now, x, q),
                               current(a->turn, x, q)};
}

struct slopes slots_slopes(const struct slots_angle *a, double x, double q)
{
    const double *k = a->now;
    double qq = 2 * (k[QQ] + k[XQQ] * x) + 12 * k[Q4] * q * q + 6 * k[Q3] * q;
    return (struct slopes){2 * k[XX] / 1.5, (2 * k[XQQ] * q + k[XQ]) / 1.5, qq / 1.5};
}

double slots_steepest(const struct slots *s, double x, double q)
{
    const double *k = s->steepest;
    x = fabs(x);
    q = fabs(q);
    return (2 * k[XX] + 2 * k[QQ] + 2 * k[XQQ] * (x + q) + 12 * k[Q4] * q * q + k[XQ] + 6 * k[Q3] * q) / 1.5;
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "meter.h"

#include <math.h>
#include <stdbool.h>

void meter_add(struct meter *m, double dt_s, const double from_a[3], const double to_a[3], double torque_nm)
{
    for (int k = 0; k < 3; k++) {
        double a = from_a[k], b = to_a[k];
        m->charge_as[k] += dt_s / 2 * (a + b);
        m->square_a2s[k] += dt_s / 3 * (a * a + a * b + b * b);
        double size_a = fabs(a) > fabs(b) ? fabs(a) : fabs(b);
        m->peak_a[k] = size_a > m->peak_a[k] ? size_a : m->peak_a[k];
        m->i_a[k] = b;
    }
    m->torque_nms += dt_s / 2 * (m->torque_nm + torque_nm);
    m->torque_nm = torque_nm;
    m->time_s += dt_s;
}

void meter_read(struct meter *m, struct meter_reading *r)
{
    struct meter fresh = {.i_a = {m->i_a[0], m->i_a[1], m->i_a[2]}, .torque_nm = m->torque_nm};
    bool any = m->time_s > 0;
    for (int k = 0; k < 3; k++) {
        r->i_mean_a[k] = any ? m->charge_as[k] / m->time_s : m->i_a[k];
        r->i_rms_a[k] = any ? sqrt(m->square_a2s[k] / m->time_s) : fabs(m->i_a[k]);
        r->i_peak_a[k] = any ? m->peak_a[k] : fabs(m->i_a[k]);
    }
    r->torque_mean_nm = any ? m->torque_nms / m->time_s : m->torque_nm;
    *m = fresh;
}

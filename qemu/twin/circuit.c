/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "circuit.h"

#include <math.h>
#include <string.h>

bool circuit_floats(const struct inverter *inv, int k)
{
    return inv->leg[k] == LEG_BLOCKED || inv->leg[k] == LEG_JUST_OFF;
}

void circuit_leg_source(const struct inverter *inv, int k, double *emf_v, double *r_ohm)
{
    switch (inv->leg[k]) {
    case LEG_HIGH:
        *emf_v = inv->bus_v;
        *r_ohm = inv->p.r_on_ohm;
        break;
    case LEG_LOW:
        *emf_v = 0;
        *r_ohm = inv->p.r_on_ohm;
        break;
    case LEG_BOTH:
        *emf_v = inv->bus_v / 2;
        *r_ohm = inv->p.r_on_ohm / 2;
        break;
    case LEG_DIODE_LO:
        *emf_v = -inv->p.diode_v;
        *r_ohm = 0;
        break;
    case LEG_DIODE_HI:
        *emf_v = inv->bus_v + inv->p.diode_v;
        *r_ohm = 0;
        break;
    default: /* nothing flows */
        *emf_v = 0;
        *r_ohm = 0;
        break;
    }
}

/* Two terminals joined by R: the current s from x to y follows from the two sources and the motor's currents. */
static void add_short(const struct inverter *inv, struct circuit *c)
{
    int x = inv->short_from, y = inv->short_to, other = 3 - x - y;
    bool float_x = circuit_floats(inv, x), float_y = circuit_floats(inv, y);
    struct motor_source *src = &c->source;
    double r_x = src->r_ohm[x][x], r_y = src->r_ohm[y][y], e_x = src->emf_v[x], e_y = src->emf_v[y];

    c->r_max_ohm = fmax(c->r_max_ohm, inv->short_ohm);
    if (!float_x && !float_y) {
        double loop_ohm = inv->short_ohm + r_x + r_y;
        c->short_emf_a = (e_x - e_y) / loop_ohm;
        c->short_gain[x] = -r_x / loop_ohm;
        c->short_gain[y] = r_y / loop_ohm;
        src->emf_v[x] = e_x - r_x * c->short_emf_a;
        src->emf_v[y] = e_y + r_y * c->short_emf_a;
        src->r_ohm[x][x] = r_x - r_x * r_x / loop_ohm;
        src->r_ohm[y][y] = r_y - r_y * r_y / loop_ohm;
        src->r_ohm[x][y] = src->r_ohm[y][x] = r_x * r_y / loop_ohm;
    } else if (!float_y) {
        c->short_gain[x] = -1;
        src->emf_v[x] = e_y;
        src->r_ohm[x][x] = r_y + inv->short_ohm;
        src->r_ohm[x][y] = src->r_ohm[y][x] = r_y;
    } else if (!float_x) {
        c->short_gain[y] = 1;
        src->emf_v[y] = e_x;
        src->r_ohm[y][y] = r_x + inv->short_ohm;
        src->r_ohm[y][x] = src->r_ohm[x][y] = r_x;
    } else {
        c->short_gain[x] = -1;
        src->r_ohm[x][x] = inv->short_ohm;
        src->held[other] = true; /* the joined pair floats, so nothing can return through the third wire */
    }
    src->held[x] = inv->wire_open[x];
    src->held[y] = inv->wire_open[y];
}

void circuit_build(const struct inverter *inv, struct circuit *c)
{
    memset(c, 0, sizeof *c);
    for (int k = 0; k < 3; k++) {
        circuit_leg_source(inv, k, &c->source.emf_v[k], &c->source.r_ohm[k][k]);
        c->source.held[k] = circuit_floats(inv, k) || inv->wire_open[k];
        c->r_max_ohm = fmax(c->r_max_ohm, c->source.r_ohm[k][k]);
    }
    if (inv->short_from >= 0) {
        add_short(inv, c);
    }
}

void circuit_leg_currents(const struct inverter *inv, const struct circuit *c, const double i_motor_a[3], double i_a[3])
{
    memcpy(i_a, i_motor_a, 3 * sizeof *i_a);
    if (inv->short_from >= 0) {
        double s = c->short_emf_a;
        for (int k = 0; k < 3; k++) {
            s += c->short_gain[k] * i_motor_a[k];
        }
        i_a[inv->short_from] += s;
        i_a[inv->short_to] -= s;
    }
}

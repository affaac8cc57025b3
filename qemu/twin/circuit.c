/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "circuit.h"

#include <math.h>
#include <string.h>

#define KNEE_SHARE 0.01 /* of the trip level: below it, a switch's constant drop falls to zero with its current */

bool circuit_floats(const struct inverter *inv, int k)
{
    return inv->leg[k] == LEG_BLOCKED || inv->leg[k] == LEG_JUST_OFF;
}

/* One leg: v = share * bus + emf_v - r_ohm * i. */
struct branch {
    double share, emf_v, r_ohm;
};

static double knee_a(const struct inverter *inv)
{
    return KNEE_SHARE * inv->p.oc_trip_a;
}

/* The drop follows the current of the step's start. A switch with a threshold, an IGBT, leaves what flows back to its
 * diode. */
static struct branch switch_on(const struct inverter *inv, double share, double i_a)
{
    const struct inverter_params *p = &inv->p;
    if (p->switch_v == 0) {
        return (struct branch){share, 0, p->r_on_ohm};
    }
    bool back = (share > 0) != (i_a > 0);
    double threshold_v = back ? p->diode_v : p->switch_v, r_ohm = back ? p->diode_ohm : p->r_on_ohm;
    if (fabs(i_a) < knee_a(inv)) {
        return (struct branch){share, 0, r_ohm + threshold_v / knee_a(inv)};
    }
    return (struct branch){share, i_a > 0 ? -threshold_v : threshold_v, r_ohm};
}

static inline struct branch branch_of(const struct inverter *inv, int k, double dt_s)
{
    const struct inverter_params *p = &inv->p;
    switch (inv->leg[k]) {
    case LEG_HIGH:
        return switch_on(inv, 1, inv->leg_a[k]);
    case LEG_LOW:
        return switch_on(inv, 0, inv->leg_a[k]);
    case LEG_BOTH:
        return (struct branch){0.5, 0, p->r_on_ohm / 2};
    case LEG_DIODE_LO:
        return (struct branch){0, -p->diode_v, p->diode_ohm};
    case LEG_DIODE_HI:
        return (struct branch){1, p->diode_v, p->diode_ohm};
    case LEG_SWING:
        return (struct branch){0, inv->node[k].v, dt_s / (2 * inv->node_f)};
    default: /* nothing flows */
        return (struct branch){0, 0, 0};
    }
}

double circuit_largest_ohm(const struct inverter *inv)
{
    double largest_ohm = inv->short_from >= 0 ? inv->short_ohm : 0;
    for (int k = 0; k < 3; k++) {
        double r_ohm = inv->leg[k] == LEG_SWING ? 0 : branch_of(inv, k, 0).r_ohm;
        largest_ohm = r_ohm > largest_ohm ? r_ohm : largest_ohm;
    }
    return largest_ohm + (inv->supply.plain ? 0 : inv->p.bus_esr_ohm);
}

double circuit_leg_v(const struct inverter *inv, int k, double i_a)
{
    struct branch b = branch_of(inv, k, 0);
    return b.share * inv->bus_v + b.emf_v - b.r_ohm * i_a;
}

double circuit_switch_w(const struct inverter *inv, int k, double mean_a, double square_a2)
{
    struct branch b = switch_on(inv, inv->leg[k] == LEG_HIGH, inv->leg_a[k]);
    return b.r_ohm * square_a2 - b.emf_v * mean_a;
}

/* A floating terminal joined to one that is held by its leg: its motor current flows there and on through R. */
static void hang(struct circuit *c, int floating, int held, double short_ohm)
{
    struct motor_source *src = &c->source;
    for (int l = 0; l < 3; l++) {
        src->r_ohm[l][floating] = src->r_ohm[l][held];
    }
    memcpy(src->r_ohm[floating], src->r_ohm[held], sizeof src->r_ohm[held]);
    src->r_ohm[floating][floating] += short_ohm;
    src->emf_v[floating] = src->emf_v[held];
}

/* Two terminals held by their legs and joined: the current s from x to y follows from R s = v_x - v_y, where s adds to
 * the motor's current in x and takes from that in y. */
static void join(struct circuit *c, int x, int y, double short_ohm)
{
    struct motor_source *src = &c->source;
    double by_s_ohm[3], gain_ohm[3];
    for (int l = 0; l < 3; l++) {
        by_s_ohm[l] = src->r_ohm[l][x] - src->r_ohm[l][y];
        gain_ohm[l] = src->r_ohm[x][l] - src->r_ohm[y][l];
    }
    double loop_ohm = short_ohm + by_s_ohm[x] - by_s_ohm[y];
    c->short_emf_a = (src->emf_v[x] - src->emf_v[y]) / loop_ohm;
    for (int l = 0; l < 3; l++) {
        c->short_gain[l] = -gain_ohm[l] / loop_ohm;
        src->emf_v[l] -= by_s_ohm[l] * c->short_emf_a;
        for (int n = 0; n < 3; n++) {
            src->r_ohm[l][n] -= by_s_ohm[l] * gain_ohm[n] / loop_ohm;
        }
    }
}

static void add_short(const struct inverter *inv, struct circuit *c)
{
    int x = inv->short_from, y = inv->short_to, other = 3 - x - y;
    bool float_x = circuit_floats(inv, x), float_y = circuit_floats(inv, y);

    if (!float_x && !float_y) {
        join(c, x, y, inv->short_ohm);
    } else if (!float_y) {
        c->short_gain[x] = -1;
        hang(c, x, y, inv->short_ohm);
    } else if (!float_x) {
        c->short_gain[y] = 1;
        hang(c, y, x, inv->short_ohm);
    } else {
        c->short_gain[x] = -1;
        c->source.r_ohm[x][x] = inv->short_ohm;
        c->source.held[other] = true; /* the joined pair floats, so nothing can return through the third wire */
    }
    c->source.held[x] = inv->wire_open[x];
    c->source.held[y] = inv->wire_open[y];
}

/* What the current of leg l takes from the voltages of those on the bus. */
static void add_bus(const struct inverter *inv, double bus_ohm, const double share[3], struct circuit *c)
{
    for (int l = 0; l < 3; l++) {
        double by_l_ohm = bus_ohm * circuit_bus_share(inv->leg[l]);
        for (int k = 0; k < 3; k++) {
            c->source.r_ohm[k][l] += share[k] * by_l_ohm;
        }
    }
}

void circuit_build(const struct inverter *inv, const struct bus_view *bus, double dt_s, struct circuit *c)
{
    double share[3];
    memset(c->source.r_ohm, 0, sizeof c->source.r_ohm);
    for (int k = 0; k < 3; k++) {
        struct branch b = branch_of(inv, k, dt_s);
        share[k] = b.share;
        c->source.emf_v[k] = b.share * bus->open_v + b.emf_v;
        c->source.r_ohm[k][k] = b.r_ohm;
        c->source.held[k] = circuit_floats(inv, k) || inv->wire_open[k];
    }
    if (bus->ohm > 0) {
        add_bus(inv, bus->ohm, share, c);
    }
    if (inv->short_from >= 0) {
        memset(c->short_gain, 0, sizeof c->short_gain);
        c->short_emf_a = 0;
        add_short(inv, c);
    }
}

void circuit_build_now(const struct inverter *inv, struct circuit *c)
{
    struct bus_view bus = {.open_v = inv->bus_v};
    circuit_build(inv, &bus, 0, c);
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

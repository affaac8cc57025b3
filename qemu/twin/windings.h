/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Between the three phases and the rotor's dq frame. */
#ifndef TWIN_WINDINGS_H
#define TWIN_WINDINGS_H

#include "motor.h"

#define SQRT3 1.7320508075688772

/* Electrical angle of the magnetic axes of A, B, C. */
static const double axis_cos[3] = {1.0, -0.5, -0.5};
static const double axis_sin[3] = {0.0, SQRT3 / 2, -SQRT3 / 2};

static inline double dot(struct dq a, struct dq b)
{
    return a.d * b.d + a.q * b.q;
}

static inline struct dq plus(struct dq a, double factor, struct dq b)
{
    return (struct dq){a.d + factor * b.d, a.q + factor * b.q};
}

/* The magnetic axis of a phase as the rotor sees it. */
static inline struct dq phase_axis(int phase, double s, double c)
{
    return (struct dq){axis_cos[phase] * c + axis_sin[phase] * s, axis_sin[phase] * c - axis_cos[phase] * s};
}

static inline void to_phases(struct dq x, double s, double c, double abc[3])
{
    double alpha = x.d * c - x.q * s, beta = x.d * s + x.q * c;
    abc[0] = alpha;
    abc[1] = -0.5 * alpha + SQRT3 / 2 * beta;
    abc[2] = -0.5 * alpha - SQRT3 / 2 * beta;
}

/* Shorted turns draw fraction * loop_a beside the field's current of their phase; two thirds of it stand on its axis. */
static inline struct dq with_loop(const struct winding_short *f, struct dq i, struct dq fault, double loop_a)
{
    return plus(i, 2.0 / 3 * f->fraction * loop_a, fault);
}

/* What a volt second along an axis adds to the current of the terminals: the field's G and the loop's 1/L. */
static inline struct slopes terminal_slopes(const struct motor *m, const struct field_point *at, struct dq fault)
{
    struct slopes g = motor_field_slopes(&m->field, at);
    double loop = 2.0 / 3 * m->fault.fraction * m->fault.fraction * m->fault.loop_per_h;
    return (struct slopes){g.dd + loop * fault.d * fault.d, g.dq + loop * fault.d * fault.q,
                           g.qq + loop * fault.q * fault.q};
}

static inline double along(struct slopes g, struct dq axis)
{
    return g.dd * axis.d * axis.d + 2 * g.dq * axis.d * axis.q + g.qq * axis.q * axis.q;
}

/* All terminals held: makes every current of theirs zero. */
void motor_hold_all(struct motor *m);
/* Brings up to date what follows from the flux linkage. */
void motor_follow_flux(struct motor *m);
/* Heat of a step, in the winding and in the iron. */
void motor_warm(struct motor *m, double copper_j, double iron_j, double dt_s);
/* The magnets' flux follows their temperature; the flux linkage stays, so the currents change a little. */
void motor_follow_temperature(struct motor *m);

#endif

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The encoder's disc on the shaft: which edges of A and B have passed, where the index pulse stands, and which edges the
 * receiver miscounts.
 *
 * A line of the disc is one period of A and of B, four edges. In shares of a line, with a = encoder_asymmetry and
 * p = encoder_phase:
 *
 *   A rises at -a, falls at 1/2 + a;  B rises at 1/4 + p - a, falls at 3/4 + p + a
 *
 * so both are high for 1/2 + 2a and B follows A by 1/4 + p, from middle to middle. An eccentric disc shows the angle
 * theta + encoder_ecc_rad sin(theta - encoder_ecc_phase_rad). */
#ifndef TWIN_DISC_H
#define TWIN_DISC_H

#include <stdint.h>

#include "encoder.h"
#include "random.h"
#include "sensor_keys.h"

/* One kind of miscount: a Poisson process over the edges that pass, in either direction. */
struct miscount {
    double mean_gap; /* edges between two; 0: there are none */
    double next;     /* edges until the next one */
    struct random random;
};

struct disc {
    double edges_per_turn;
    double shift[4]; /* of the four edges of a line, in edges */
    double ecc_rad, ecc_phase_rad;
    double from_rad, to_rad; /* shaft angles between which the count surely stays as it is */
    int64_t edges;
    struct index_pulse index;
    struct miscount lost, extra;
};

void disc_init(struct disc *d, const struct sensor_params *p, uint64_t seed);
/* Edges since angle 0. Called at every step of the integration: costs two comparisons while none passes. */
int64_t disc_edges(struct disc *d, double theta_rad);
/* How the shaft has moved: angles and speeds at both ends. */
struct disc_way {
    double from_rad, to_rad, from_rad_s, to_rad_s, length_s;
};

/* After which part of a way that moved the count by so many edges, and has just been shown to disc_edges(), the last of
 * them passed. */
double disc_edge_part(const struct disc *d, const struct disc_way *w, int64_t moved);
/* What a counter adds to the count when so many edges have passed: a lost edge is not counted, an extra one twice. */
int64_t disc_miscounts(struct disc *d, int64_t moved);

#endif

/* SPDX-License-Identifier: MIT */
/* A rotor with friction, cogging, a hoist or a load on a coupling, on a perfect current source: the alignment's, quickly. */
#ifndef TESTS_UNIT_HOST_ROTOR_H
#define TESTS_UNIT_HOST_ROTOR_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/commission/alignment.h"

struct rotor_case {
    int32_t pole_pairs, counts, resistance_mohm, flux_uwb, ld_uh, lq_uh;
    int32_t inertia_gmm2;
    int32_t start_deg; /* electrical */
    int32_t hoist_unm, friction_unm, cogging_unm, cogging_per_rev;
    int32_t along_mv, across_mv;    /* what dead time leaves in the voltages while current flows */
    int32_t coupling_hz, load_gmm2; /* its resonance with a load of this inertia; 0: a rigid shaft */
    bool backwards, dead, locked;
};

struct rotor_outcome {
    int32_t result; /* enum alignment_result */
    int32_t error_mdeg, time_ms, moved_mturn;
    int32_t fastest_mrpm, fastest_ms; /* and when */
    int32_t detail[2];
};

void rotor_align(const struct rotor_case *k, const struct params *p, struct rotor_outcome *out);

#endif

/* SPDX-License-Identifier: MIT */
/*
 * The currents of least amplitude for a torque (maximum torque per ampere) of a machine with constant inductances.
 *
 * Torque is 1.5 p i_q (psi - L i_d), L = L_q - L_d. Among currents of amplitude I it is largest for
 * i_d = (psi - sqrt(psi^2 + 8 L^2 I^2)) / (4 L) (Morimoto, Takeda, Hirasa, Taniguchi: "Expansion of operating limits for
 * permanent magnet motor by current vector control considering inverter capacity", IEEE Trans. Ind. Appl. 26(5), 1990).
 * With L = 0 that is i_d = 0; with L_d > L_q it is positive. The inductances are apparent ones, flux over current: in saturated
 * iron, the incremental ones, which the current loops see, may be a third of them.
 *
 * All of it: thread, 64-bit divisions and roots.
 */
#ifndef FIRMWARE_SETTINGS_MTPA_H
#define FIRMWARE_SETTINGS_MTPA_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/settings/params.h"

#define MTPA_ONE_Q20 (1 << 20)

/* Flux linkages of the magnet and, at a current of i_range, of |L|: in nWb / 2^shift, so the larger has 28 bits. */
struct mtpa_machine {
    int64_t magnet;
    int64_t saliency;
    int32_t shift;
    bool reversed; /* L_d > L_q: i_d is positive */
};

/* Inductances as torque and flux see them. */
static inline int32_t mtpa_ld_uh(const struct params *p)
{
    return p->ld_apparent_uh > 0 ? p->ld_apparent_uh : p->ld_uh;
}

static inline int32_t mtpa_lq_uh(const struct params *p)
{
    return p->lq_apparent_uh > 0 ? p->lq_apparent_uh : p->lq_uh;
}

/* Amplitudes, Q20 of i_range; torque in its own unit, up to 2^51. */
struct mtpa_point {
    int64_t i_d_q20;
    int64_t i_q_q20;
    int64_t torque;
};

/* Any parameters within their ranges. */
struct mtpa_machine mtpa_machine(const struct params *p);

/* For an amplitude of 0...2 i_range. */
struct mtpa_point mtpa_point(const struct mtpa_machine *m, int64_t i_q20);

/* Torque per ampere and 1.5 pole pairs at a current of i_range, as a magnet flux, nWb: the value of a torque of 1.0. */
int64_t mtpa_flux_nwb(const struct params *p);

/* Root of a square of 0...2^63 - 1, rounded down. */
int64_t mtpa_root(int64_t square);

#endif

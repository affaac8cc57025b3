/* SPDX-License-Identifier: MIT */
#include "firmware/settings/mtpa.h"

int64_t mtpa_root(int64_t square)
{
    uint64_t rest = (uint64_t)square;
    uint64_t result = 0;
    for (uint64_t bit = 1ULL << 62; bit != 0u; bit >>= 2) {
        const bool fits = rest >= result + bit;
        rest -= fits ? result + bit : 0u;
        result = (result >> 1) + (fits ? bit : 0u);
    }
    return (int64_t)result;
}

struct mtpa_machine mtpa_machine(const struct params *p)
{
    const int64_t difference_uh = (int64_t)mtpa_lq_uh(p) - mtpa_ld_uh(p);
    struct mtpa_machine m = {.magnet = 1000LL * p->flux_uwb, .reversed = difference_uh < 0};
    m.saliency = (m.reversed ? -difference_uh : difference_uh) * p->i_range_ma;
    for (; m.magnet >= 1 << 28 || m.saliency >= 1 << 28; m.shift++) {
        m.magnet >>= 1;
        m.saliency >>= 1;
    }
    for (; m.magnet < 1 << 27 && m.saliency < 1 << 27; m.shift--) {
        m.magnet <<= 1;
        m.saliency <<= 1;
    }
    return m;
}

/*
 * i_d as 2 L I^2 / (psi + sqrt(psi^2 + 8 L^2 I^2)): equivalent, without a difference of nearly equal numbers. Magnitudes: i_d
 * has the sign of -L, so both parts of the torque add up. For I up to 2.
 */
struct mtpa_point mtpa_point(const struct mtpa_machine *m, int64_t i_q20)
{
    const int64_t saliency = (m->saliency * i_q20) >> 20;
    const int64_t wide = mtpa_root(m->magnet * m->magnet + 8 * saliency * saliency);
    struct mtpa_point p = {.i_d_q20 = 2 * saliency * i_q20 / (m->magnet + wide)};
    p.i_q_q20 = mtpa_root(i_q20 * i_q20 - p.i_d_q20 * p.i_d_q20);
    p.torque = p.i_q_q20 * (m->magnet + ((m->saliency * p.i_d_q20) >> 20));
    return p;
}

int64_t mtpa_flux_nwb(const struct params *p)
{
    const struct mtpa_machine m = mtpa_machine(p);
    if (m.saliency == 0) {
        return 1000LL * p->flux_uwb;
    }
    const int64_t flux = mtpa_point(&m, MTPA_ONE_Q20).torque >> 20;
    return m.shift >= 0 ? flux << m.shift : flux >> -m.shift;
}

/* SPDX-License-Identifier: MIT */
#include "firmware/settings/mtpa.h"

#include "lib/q15.h"

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

/* ==== the table ==== */

/* The current between `from` and `to`, Q20, for `torque`: by bisection, since torque grows with current. */
static int64_t current_of(const struct mtpa_machine *m, int64_t torque, int64_t from, int64_t to)
{
    while (to - from > 1) {
        const int64_t middle = (from + to) / 2;
        if (mtpa_point(m, middle).torque < torque) {
            from = middle;
        } else {
            to = middle;
        }
    }
    return to;
}

static int32_t q15_of_q20(int64_t x_q20)
{
    return (int32_t)((x_q20 + 16) >> 5);
}

static int32_t flux_q15(const struct params *p, const struct tuning *t, int32_t i_d_q15, int32_t i_q_q15)
{
    const int64_t d_q26 = (int64_t)t->x_d_q11 * i_d_q15 * mtpa_ld_uh(p) / p->ld_uh;
    const int64_t q_q26 = (int64_t)t->x_q_q11 * i_q_q15 * mtpa_lq_uh(p) / p->lq_uh;
    const int64_t d = (int64_t)t->emf_q12 * 8 + d_q26 / 2048;
    const int64_t q = q_q26 / 2048;
    return (int32_t)mtpa_root(d * d + q * q);
}

/* Called node by node: torque is convex over current, so no step is longer than the previous one. */
static int64_t current_of_node(struct torque_map_builder *b, int64_t torque_q15)
{
    const struct mtpa_machine *const m = &b->machine;
    if (m->saliency == 0 || b->node == 0) {
        return torque_q15 * 32;
    }
    const int64_t i_q20 = current_of(m, (b->unit * torque_q15) >> 7, b->last_q20, b->last_q20 + b->step_q20);
    b->step_q20 = i_q20 - b->last_q20 + 2;
    b->last_q20 = i_q20;
    return i_q20;
}

static void fill_node(struct torque_map *map, struct torque_map_builder *b, const struct params *params,
                      const struct tuning *t)
{
    const struct mtpa_machine *const m = &b->machine;
    const int32_t n = b->node;
    const int64_t i_q20 = current_of_node(b, (int64_t)n << map->shift);
    const struct mtpa_point p = m->saliency != 0 ? mtpa_point(m, i_q20) : (struct mtpa_point){.i_q_q20 = i_q20};
    map->i_d_q15[n] = m->reversed ? q15_of_q20(p.i_d_q20) : -q15_of_q20(p.i_d_q20);
    map->i_q_q15[n] = q15_of_q20(p.i_q_q20);
    map->current_q15[n] = q15_of_q20(i_q20);
    map->flux_q15[n] = flux_q15(params, t, map->i_d_q15[n], map->i_q_q15[n]);
}

void torque_map_build_begin(struct torque_map_builder *b, struct torque_map *map, const struct params *p,
                            const struct tuning *t)
{
    *b = (struct torque_map_builder){.machine = mtpa_machine(p), .step_q20 = 2 * MTPA_ONE_Q20};
    b->unit = mtpa_point(&b->machine, MTPA_ONE_Q20).torque >> 8;
    map->torque_max_q15 = t->i_max_q15;
    if (b->machine.saliency != 0) {
        const struct mtpa_point most = mtpa_point(&b->machine, (int64_t)t->i_max_q15 * 32);
        map->torque_max_q15 = (int32_t)(((most.torque >> 8) << 15) / b->unit);
    }
    map->shift = 0;
    while ((TORQUE_NODES - 1) << map->shift <= map->torque_max_q15) {
        map->shift++;
    }
}

bool torque_map_build_step(struct torque_map_builder *b, struct torque_map *map, const struct params *p,
                           const struct tuning *t)
{
    fill_node(map, b, p, t);
    b->node++;
    return b->node < TORQUE_NODES;
}

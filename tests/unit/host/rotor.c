/* SPDX-License-Identifier: MIT */
#include "rotor.h"

#include <math.h>
#include <string.h>

#include "firmware/settings/config.h"

#define SUBSTEPS 2
#define TURN     (2 * M_PI)
#define DAMPING  0.02 /* of critical, of the coupling */

struct rotor {
    const struct rotor_case *k;
    double p, flux_wb, angle_rad, speed_rad_s, kt_nm, load_nm, friction_nm, cogging_nm, inertia_kgm2;
    double i_range_a, v_range_v, least_rad, most_rad, fastest_rad_s;
    double coupling_nm_rad, coupling_nms, coupled_kgm2, coupled_rad, coupled_rad_s; /* what hangs on the coupling */
    int32_t v_d_q15; /* published with the next millisecond, as the slow loop does it last */
    int32_t zero;    /* of the encoder's counter */
    bool stuck;
};

static uint32_t counter(const struct rotor *r, int32_t told)
{
    const int32_t now = (int32_t)floor(r->angle_rad * r->k->counts / TURN) - r->zero;
    const int32_t seen = r->k->dead ? 0 : (r->k->backwards ? -now : now);
    return (uint32_t)((seen % told + told) % told);
}

/* The ratchet of a hoist holds at rest what the hoist pulls, and friction holds what is left. */
static bool breaks_loose(struct rotor *r, double torque_nm)
{
    const double up_nm = r->friction_nm + fmax(r->load_nm, 0), down_nm = r->friction_nm + fmax(-r->load_nm, 0);
    r->speed_rad_s = torque_nm > up_nm ? 1e-9 : -1e-9;
    return torque_nm > up_nm || torque_nm < -down_nm;
}

/* Torque of the coupling, which turns the load. */
static double coupling_nm(struct rotor *r, double dt_s)
{
    if (r->coupled_kgm2 == 0) {
        return 0;
    }
    const double nm =
        r->coupling_nm_rad * (r->angle_rad - r->coupled_rad) + r->coupling_nms * (r->speed_rad_s - r->coupled_rad_s);
    r->coupled_rad_s += nm / r->coupled_kgm2 * dt_s;
    r->coupled_rad += r->coupled_rad_s * dt_s;
    return nm;
}

static void turn(struct rotor *r, double field_rad, double current_a, double dt_s)
{
    const double lead = field_rad - r->p * r->angle_rad;
    const double saliency_h = (r->k->lq_uh - r->k->ld_uh) * 1e-6;
    const double torque_nm = r->kt_nm * current_a * sin(lead) * (1 - saliency_h * current_a * cos(lead) / r->flux_wb) -
                             r->cogging_nm * sin(r->k->cogging_per_rev * r->angle_rad) - coupling_nm(r, dt_s);
    if (r->k->locked) {
        return;
    }
    if (r->stuck && !breaks_loose(r, torque_nm)) {
        r->speed_rad_s = 0;
        return;
    }
    r->stuck = false;
    const double way = r->speed_rad_s > 0 ? 1 : -1;
    const double next = r->speed_rad_s + (torque_nm - r->load_nm - r->friction_nm * way) / r->inertia_kgm2 * dt_s;
    r->stuck = next * way <= 0;
    r->speed_rad_s = r->stuck ? 0 : next;
    r->angle_rad += r->speed_rad_s * dt_s;
    r->fastest_rad_s = fmax(r->fastest_rad_s, fabs(r->speed_rad_s));
}

/* The current loop is taken to be perfect; what it would put out for that on the q axis is what the magnets induce. */
static void run_millisecond(struct rotor *r, struct current_loop *c)
{
    const double loop_hz = CONFIG_SLOW_HZ * (double)c->loops_per_slow;
    for (int32_t n = 0; n < c->loops_per_slow; n++) {
        const double field_rad = c->field_angle_q32 / 4294967296.0 * TURN;
        const double current_a = c->i_d_ref_q15 / 32768.0 * r->i_range_a;
        for (int s = 0; s < SUBSTEPS; s++) {
            turn(r, field_rad, current_a, 1.0 / loop_hz / SUBSTEPS);
        }
        const double emf_v = r->speed_rad_s * r->p * r->flux_wb * cos(field_rad - r->p * r->angle_rad);
        const double field_rad_s = c->field_speed_q32 / 4294967296.0 * TURN * loop_hz;
        const double inductance_h = (r->k->locked ? (r->k->ld_uh + r->k->lq_uh) / 2.0 : r->k->ld_uh) * 1e-6;
        const double along_v = r->speed_rad_s * r->p * r->flux_wb * sin(field_rad - r->p * r->angle_rad);
        const double left = current_a > 0 ? 1e-3 : 0;
        c->i_d_q15 = c->i_d_ref_q15;
        const double v_d_v = along_v + r->k->resistance_mohm * 1e-3 * current_a + r->k->along_mv * left;
        r->v_d_q15 = (int32_t)lrint(v_d_v / r->v_range_v * 32768);
        const double v_q_v = emf_v + field_rad_s * inductance_h * current_a + r->k->across_mv * left;
        c->v_q_q15 = (int32_t)lrint(v_q_v / r->v_range_v * 32768);
        c->field_angle_q32 += (uint32_t)c->field_speed_q32;
    }
    r->least_rad = fmin(r->least_rad, r->angle_rad);
    r->most_rad = fmax(r->most_rad, r->angle_rad);
}

static void couple(struct rotor *r)
{
    r->coupled_kgm2 = r->k->load_gmm2 * 1e-9;
    r->coupled_rad = r->angle_rad;
    if (r->coupled_kgm2 > 0) {
        const double both_kgm2 = 1 / (1 / r->inertia_kgm2 + 1 / r->coupled_kgm2), w_rad_s = TURN * r->k->coupling_hz;
        r->coupling_nm_rad = both_kgm2 * w_rad_s * w_rad_s;
        r->coupling_nms = 2 * DAMPING * both_kgm2 * w_rad_s;
    }
}

static struct rotor made(const struct rotor_case *k, const struct params *p)
{
    struct rotor r = {.k = k, .p = k->pole_pairs, .flux_wb = k->flux_uwb * 1e-6, .stuck = true};
    r.angle_rad = r.least_rad = r.most_rad = k->start_deg / 360.0 * TURN / r.p;
    r.kt_nm = 1.5 * r.p * r.flux_wb;
    r.load_nm = k->hoist_unm * 1e-6;
    r.friction_nm = k->friction_unm * 1e-6;
    r.cogging_nm = k->cogging_unm * 1e-6;
    r.inertia_kgm2 = k->inertia_gmm2 * 1e-9;
    r.i_range_a = p->i_range_ma / 1000.0;
    r.v_range_v = p->v_range_mv / 1000.0;
    couple(&r);
    r.zero = (int32_t)floor(r.angle_rad * k->counts / TURN);
    return r;
}

void rotor_align(const struct rotor_case *k, const struct params *p, struct rotor_outcome *out)
{
    struct tuning t;
    struct current_loop c;
    struct alignment a;
    struct rotor r = made(k, p);
    current_loop_init(&c);
    (void)tuning_compute(p, &t); /* the speed loop's margins are not of interest here */
    current_loop_tune(&c, &t);
    alignment_start(&a, &c, &t, 0);
    out->result = ALIGNMENT_RUNNING;
    for (out->time_ms = 0; out->result == ALIGNMENT_RUNNING && out->time_ms < 200000; out->time_ms++) {
        const double before_rad_s = r.fastest_rad_s;
        run_millisecond(&r, &c);
        out->fastest_ms = r.fastest_rad_s > before_rad_s ? out->time_ms : out->fastest_ms;
        out->result = alignment_step(&a, &c, &t, counter(&r, p->encoder_counts));
        c.v_d_q15 = r.v_d_q15;
    }
    const double believed = counter(&r, p->encoder_counts) * (double)c.encoder_scale_q32 + c.angle_offset_q32;
    out->error_mdeg = (int32_t)lrint(remainder(believed / 4294967296.0 - r.p * r.angle_rad / TURN, 1) * 360e3);
    out->moved_mturn = (int32_t)lrint(
        fmax(r.most_rad - k->start_deg / 360.0 * TURN / r.p, k->start_deg / 360.0 * TURN / r.p - r.least_rad) * r.p /
        TURN * 1000);
    out->fastest_mrpm = (int32_t)lrint(r.fastest_rad_s / TURN * 60e3);
    out->detail[0] = a.detail[0];
    out->detail[1] = a.detail[1];
}

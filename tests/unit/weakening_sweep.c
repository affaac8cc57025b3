/* SPDX-License-Identifier: MIT */
/*
 * Over a million states of the drive: whatever the limiters do, no torque turns round, no current is beyond i_max, and the flux
 * that the currents have is one that the voltage carries. By the equations of a machine with constant inductances, in
 * floating point.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "at_once.h"
#include "firmware/settings/mtpa.h"

#define Q15        32768.0
#define TWO_PI     6.283185307179586
#define BASE_RAD_S (TWO_PI * CONFIG_SPEED_BASE_HZ)

struct counts {
    long states, weakened, limited, reversed, beyond_current, beyond_flux, other_torque;
};

static uint32_t seed = 12345;

static double any(double low, double high)
{
    seed ^= seed << 13;
    seed ^= seed >> 17;
    seed ^= seed << 5;
    return low + (high - low) * (seed / 4294967296.0);
}

struct machine {
    struct params p;
    struct tuning t;
    struct torque_control torque;
    double magnet, x_d, x_q, unit; /* per unit, at the base speed */
};

static void make(struct machine *m, int32_t ld_uh, int32_t lq_uh, int32_t vbus_q15)
{
    params_init(&m->p);
    m->p.ld_uh = ld_uh;
    m->p.lq_uh = lq_uh;
    m->p.speed_max_rpm = 9000;
    m->p.overspeed_rpm = 10000;
    if (tuning_compute(&m->p, &m->t).error != ERROR_NONE) {
        exit(2);
    }
    torque_build(&m->torque, &m->p, &m->t, vbus_q15);
    const double per_henry = BASE_RAD_S * m->p.i_range_ma / m->p.v_range_mv;
    m->magnet = BASE_RAD_S * m->p.flux_uwb * 1e-3 / m->p.v_range_mv;
    m->x_d = per_henry * ld_uh * 1e-6;
    m->x_q = per_henry * lq_uh * 1e-6;
    m->unit = BASE_RAD_S * (double)mtpa_flux_nwb(&m->p) * 1e-6 / m->p.v_range_mv;
}

static void look(struct machine *m, struct counts *n)
{
    static struct current_loop loop;
    struct torque_control *const s = &m->torque;
    const int32_t w_q15 = (int32_t)any(-31000, 31000);
    const int32_t wish_q15 = any(0, 1) < 0.1 ? 0 : (int32_t)any(-32768, 32767);
    const struct torque_view view = {.speed_rpm_q4 = (int32_t)(w_q15 * 9.155),
                                     .i_limit_q15 =
                                         any(0, 1) < 0.7 ? m->t.i_max_q15 : (int32_t)any(-10, m->t.i_max_q15),
                                     .limit_speed = any(0, 1) < 0.3};
    loop.pll.speed_q32 = w_q15 * 8192;
    loop.w_shift = CONFIG_W_SHIFT;
    loop.v_d_q15 = (int32_t)any(-9000, 9000);
    loop.v_q_q15 = (int32_t)any(-9000, 9000);
    loop.weaken.on = m->t.weakens;
    loop.i_d_ref_q15 = (int32_t)any(-m->t.i_max_q15, 0);
    loop.i_q_ref_q15 = (int32_t)any(-m->t.i_max_q15, m->t.i_max_q15);
    s->torque_q15 = (int32_t)any(-32768, 32767);
    s->burn_q15 = any(0, 1) < 0.7 ? 0 : (int32_t)any(0, m->t.burn_max_q15);
    s->sink_q18 = (int32_t)any(0, 262144);
    s->energy_q25 = (int32_t)any(0, m->t.bus_set_energy_q25);
    s->flux.trim_q21 = (int32_t)any(-200000, 60000);
    s->flux.drop_q15 = (int32_t)any(-3000, 3000);
    m->t.power_max_q15 = any(0, 1) < 0.7 ? 65535 : (int32_t)any(0, 20000);
    m->t.regen_max_q15 = any(0, 1) < 0.7 ? 65535 : (int32_t)any(0, 20000);
    const int32_t before_q15 = s->torque_q15;
    torque_measure(s, &loop, &m->t, (int32_t)any(8000, 32760));
    const bool ends = loop.weaken.on && loop.weaken.q_first != 0 && (before_q15 ^ s->emf_q15) < 0;
    torque_set_limits(s, &m->t, &view);
    torque_ask(s, &loop, &m->t, wish_q15);

    const double i_d = loop.i_d_ref_q15 / Q15, i_q = loop.i_q_ref_q15 / Q15;
    const double flux = hypot(m->magnet + m->x_d * i_d, m->x_q * i_q);
    const double least = fmax(m->magnet - m->x_d * m->t.i_max_q15 / Q15, 0);
    const double made = i_q * (m->magnet - (m->x_q - m->x_d) * i_d) / m->unit * Q15;
    const double lsb = (m->x_d + m->x_q) * 3 / Q15 + 0.002 * m->magnet;
    n->states++;
    n->weakened += s->flux.decides;
    n->limited += s->torque_q15 != wish_q15;
    const bool turned =
        (double)s->torque_q15 * wish_q15 < 0 || made * wish_q15 < 0 || abs(s->torque_q15) > abs(wish_q15);
    /* what brakes deep in weakening may end later than it is wished, but gets no larger */
    const bool fades = ends && (double)s->torque_q15 * before_q15 >= 0 && abs(s->torque_q15) < abs(before_q15);
    n->reversed += (turned && !fades) || s->limits.low > 0 || s->limits.high < 0;
    n->beyond_current += hypot(i_d, i_q) * Q15 > m->t.i_max_q15 + 2;
    if (s->flux.flux_q15 != FLUX_UNLIMITED) {
        n->beyond_flux += flux > fmax(s->flux.flux_q15 / Q15, least) + lsb;
    }
    n->other_torque += fabs(made) > 1.03 * abs(s->torque_q15) + 60;
}

int main(int count, char **arguments)
{
    static const int32_t uh[][2] = {{200, 200}, {200, 400}, {400, 200}, {600, 600}, {200, 1200}};
    static struct machine m;
    const long states = count > 1 ? atol(arguments[1]) : 250000;
    for (unsigned k = 0; k < sizeof uh / sizeof uh[0]; k++) {
        struct counts n = {0};
        make(&m, uh[k][0], uh[k][1], 13600);
        for (long state = 0; state < states; state++) {
            look(&m, &n);
        }
        printf("%d %d %d %ld %ld %ld %ld %ld %ld %ld\n", (int)uh[k][0], (int)uh[k][1], (int)m.t.weakens, n.states,
               n.weakened, n.limited, n.reversed, n.beyond_current, n.beyond_flux, n.other_torque);
    }
    return 0;
}

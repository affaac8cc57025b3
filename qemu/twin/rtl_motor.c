/* SPDX-License-Identifier: GPL-2.0-or-later */
#define _GNU_SOURCE
#include "rtl_motor.h"

#include <math.h>
#include <stdlib.h>

#include "plant_words.h"
#include "rtl_parts.h"

#define WORD_ONE   17179869184.0
#define TURN       68719476736.0
#define TWO_PI     6.283185307179586
#define CONTROL    0x04
#define FAULT      0x08
#define DELAY      0x0C
#define INDEX      0x1C
#define REACH      0x20
#define HALL       0x24
#define TEMP       0x28
#define SINKS      2u
#define SQRT3_HALF 0.8660254037844386

struct rtl_motor_state {
    struct plant_words words;
    const struct rtl_motor_calls *calls;
    struct rtl_axis *axis;
    int64_t clock; /* when it was looked at last */
    uint32_t fault, control, temperature;
    double vbus_v, i_a[3], alpha_vs, beta_vs;
    double angle; /* of the shaft, a turn is 1: within the present turn */
};

static double value(const struct rtl_motor_state *s, int place)
{
    return (double)s->calls->get(s->axis, place) / WORD_ONE;
}

/* ---- what is done to it ---- */

static void put_shaft(struct rtl_motor_state *s, const struct motor *m)
{
    int64_t load = s->words.word[PLANT_TLN], inertia = s->words.word[PLANT_KW];
    plant_words_shaft(&s->words, m);
    if (s->words.word[PLANT_TLN] != load) {
        s->calls->put(s->axis, PLANT_TLN, s->words.word[PLANT_TLN]);
    }
    if (s->words.word[PLANT_KW] != inertia) {
        s->calls->put(s->axis, PLANT_KW, s->words.word[PLANT_KW]);
    }
    if (m->shaft != SHAFT_FREE) { /* a step under way may write it once more */
        s->calls->put(s->axis, PLANT_W, plant_word(m->speed_rad_s / s->words.base.rad_s));
    }
}

static void put_register(struct rtl_motor_state *s, uint32_t offset, uint32_t word, uint32_t *known)
{
    if (word != *known) {
        *known = word;
        s->calls->write(s->axis, offset, word);
    }
}

static uint32_t faults(const struct plant *p, bool cut)
{
    uint32_t fault = cut ? 8 : 0;
    for (int k = 0; k < 3; k++) {
        fault |= p->inverter.wire_open[k] ? 1u << k : 0;
        fault |= p->sensors.current[k].stuck_code >= 0 ? 16u << k : 0;
    }
    return fault;
}

static void hand_on(struct rtl_motor_state *s, const struct fabric_rtl *r, const struct plant *p)
{
    put_shaft(s, &p->motor);
    put_register(s, FAULT, faults(p, r->lines.now.lost), &s->fault);
    bool sinks = p->inverter.p.supply_sinks != 0;
    put_register(s, CONTROL, sinks ? s->words.control | SINKS : s->words.control & ~SINKS, &s->control);
    put_register(s, TEMP, r->thermometer.code, &s->temperature);
    if (p->inverter.p.vbus_v != s->vbus_v) {
        s->vbus_v = p->inverter.p.vbus_v;
        s->calls->put(s->axis, PLANT_VS, plant_word(s->vbus_v / s->words.base.v));
    }
}

/* ---- what it is ---- */

static void look_at_shaft(struct rtl_motor_state *s, struct motor *m)
{
    double angle = (double)s->calls->get(s->axis, PLANT_THM) / TURN, moved = angle - s->angle;
    s->angle = angle;
    m->theta_rad += TWO_PI * (moved - floor(moved + 0.5));
    if (m->shaft == SHAFT_FREE) {
        m->speed_rad_s = m->load_speed_rad_s = value(s, PLANT_W) * s->words.base.rad_s;
    }
    sincos(m->p.pole_pairs * m->theta_rad, &m->sin_e, &m->cos_e);
}

static void look_at_machine(struct rtl_motor_state *s, struct motor *m, double dt_s)
{
    const struct plant_bases *b = &s->words.base;
    double alpha_vs = value(s, PLANT_FA) * b->vs, beta_vs = value(s, PLANT_FB) * b->vs;
    double alpha_a = value(s, PLANT_IA) * b->a, beta_a = value(s, PLANT_IBETA) * b->a;
    m->i_d_a = alpha_a * m->cos_e + beta_a * m->sin_e;
    m->i_q_a = beta_a * m->cos_e - alpha_a * m->sin_e;
    m->torque_nm = 1.5 * m->p.pole_pairs * (m->p.flux_wb + (m->p.ld_h - m->p.lq_h) * m->i_d_a) * m->i_q_a;
    m->volt_alpha_vs += alpha_vs - s->alpha_vs + dt_s * m->p.resistance_ohm * alpha_a;
    m->volt_beta_vs += beta_vs - s->beta_vs + dt_s * m->p.resistance_ohm * beta_a;
    s->alpha_vs = alpha_vs;
    s->beta_vs = beta_vs;
}

static void follow(struct fabric *f, struct plant *p)
{
    struct fabric_rtl *r = rtl_of(f);
    struct rtl_motor_state *s = r->motor;
    hand_on(s, r, p);
    if (r->clock == s->clock) {
        return;
    }
    double dt_s = (double)(r->clock - s->clock) * 1e-8, i_a[3];
    s->clock = r->clock;
    look_at_shaft(s, &p->motor);
    look_at_machine(s, &p->motor, dt_s);
    p->inverter.bus_v = p->inverter.supply.cap_v = value(s, PLANT_U) * s->words.base.v;
    motor_currents(&p->motor, i_a);
    meter_add(&p->meter, dt_s, s->i_a, i_a, p->motor.torque_nm);
    for (int k = 0; k < 3; k++) {
        s->i_a[k] = i_a[k];
    }
}

void rtl_motor_open(struct fabric *f, const struct plant_params *params)
{
    struct fabric_rtl *r = rtl_of(f);
    if (!r->calls->motor) {
        return;
    }
    const char *lack = plant_words_lack(params);
    struct rtl_motor_state *s = calloc(1, sizeof *s);
    if (lack || !s) {
        rtl_fail("PLANT=rtl has not", lack ? lack : "enough memory");
    }
    plant_words_make(&s->words, params);
    s->calls = r->calls->motor;
    s->axis = r->axis;
    s->vbus_v = params->inverter.vbus_v;
    s->angle = params->motor.initial_angle_rad / TWO_PI;
    s->alpha_vs = (double)s->words.word[PLANT_FA] / WORD_ONE * s->words.base.vs;
    s->beta_vs = (double)s->words.word[PLANT_FB] / WORD_ONE * s->words.base.vs;
    for (int n = 0; n < PLANT_WORDS; n++) {
        s->calls->put(s->axis, n, s->words.word[n]);
    }
    s->calls->write(s->axis, DELAY, s->words.delay);
    s->calls->write(s->axis, INDEX, s->words.index);
    s->calls->write(s->axis, REACH, s->words.reach);
    s->calls->write(s->axis, HALL, s->words.hall);
    r->motor = s;
    f->follow_motor = follow;
}

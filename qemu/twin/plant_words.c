/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "plant_words.h"

#include <math.h>
#include <string.h>

#define ONE        17179869184.0 /* 2^34, of a word */
#define TURN       68719476736.0 /* 2^36 */
#define TWO_PI     6.283185307179586
#define CLOCK_S    1e-8
#define ANGLE_UNIT 134217728.0 /* 2^27 a turn, of the angle's increments */
#define HOLD_SHARE 0.6         /* of the voltage that would end the current of an open leg within a step */

static int64_t rounded(double value)
{
    return (int64_t)floor(value + 0.5);
}

int64_t plant_word(double per_unit)
{
    double limit = 2 * ONE - 1, value = per_unit * ONE;
    return rounded(value > limit ? limit : value < -limit ? -limit : value);
}

/* Mantissa of 18 bits, 2^17 at most, and the exponent e of 2^(10 - e); a factor of 1 is 2^18 of both. */
int64_t plant_coefficient(double factor)
{
    int exponent;
    double mantissa = frexp(factor * 262144.0, &exponent) * 131072.0; /* exponent - 17 is the power of two */
    int e = 10 - (exponent - 17);
    if (fabs(mantissa) >= 131071.5) {
        mantissa /= 2;
        e--;
    }
    if (e > 31) {
        mantissa = ldexp(mantissa, 31 - e);
        e = 31;
    }
    if (e < 0) {
        mantissa = mantissa > 0 ? 131071 : -131071;
        e = 0;
    }
    return rounded(mantissa) * 262144 + e;
}

int64_t plant_angle(double turns)
{
    double left = turns - floor(turns + 0.5);
    int64_t value = rounded(left * TURN);
    return value >= (int64_t)(TURN / 2) ? value - (int64_t)TURN : value;
}

/* ---- bases ---- */

static double larger_of(double a, double b)
{
    return a > b ? a : b;
}

/* So that twice a base is more than there ever is, and a base not much less. */
static struct plant_bases bases_of(const struct plant_params *p)
{
    const struct motor_params *m = &p->motor;
    double limit_a = p->sensors.i_range_a > 0 ? p->sensors.i_range_a : p->inverter.oc_trip_a;
    struct plant_bases b = {.v = p->inverter.vbus_v * 1.05, .a = 0.8 * limit_a, .step_s = PLANT_STEP_CLOCKS * CLOCK_S};
    b.vs = 0.6 * (m->flux_wb + larger_of(m->ld_h, m->lq_h) * 1.6 * b.a);
    b.nm = 1.5 * m->pole_pairs * b.vs * b.a;
    b.rad_s = 1.2 * p->inverter.vbus_v / (m->flux_wb * m->pole_pairs * 1.7320508);
    return b;
}

static void set(struct plant_words *w, int place, int64_t word)
{
    w->word[place] = word;
    w->set[place] = true;
}

static void factor(struct plant_words *w, int place, double value)
{
    set(w, place, plant_coefficient(value));
}

static void number(struct plant_words *w, int place, double per_unit)
{
    set(w, place, plant_word(per_unit));
}

static void whole(struct plant_words *w, int place, double mantissa, int exponent)
{
    set(w, place, rounded(mantissa) * 262144 + exponent);
}

/* ---- parts ---- */

static void constants(struct plant_words *w)
{
    set(w, PLANT_ZERO, 0);
    factor(w, PLANT_ONE, 1);
    factor(w, PLANT_TWO, 2);
    factor(w, PLANT_HALF, 0.5);
    factor(w, PLANT_SQ32, 0.8660254037844386);
    /* sin and cos of a quarter turn times -1...1, least largest error */
    number(w, PLANT_S0, 1.5707910110771168);
    number(w, PLANT_S1, -0.6458928495597747);
    number(w, PLANT_S2, 0.07943434463860112);
    factor(w, PLANT_S3, -0.004333095304543291);
    number(w, PLANT_C0, 0.9999932945831203);
    number(w, PLANT_C1, -1.2334844911431424);
    number(w, PLANT_C2, 0.25258020534072173);
    factor(w, PLANT_C3, -0.019095712787469386);
    number(w, PLANT_A0, 1.5703200190905815);
    number(w, PLANT_A1, -0.6421131667253351);
    factor(w, PLANT_A2, 0.0718608540239444);
}

static void bridge(struct plant_words *w, const struct plant_params *p)
{
    const struct inverter_params *v = &p->inverter;
    const struct plant_bases *b = &w->base;
    double steps = PLANT_STEP_CLOCKS, blow = b->step_s * b->v / b->vs, root = 1.7320508075688772;
    double diode = v->diode_v / b->v, knee = v->switch_v / b->v;
    double least_h = p->motor.ld_h < p->motor.lq_h ? p->motor.ld_h : p->motor.lq_h;
    factor(w, PLANT_KVA, blow * 128 / steps / 3);
    factor(w, PLANT_KVB, blow * 128 / steps / root);
    factor(w, PLANT_KDA, diode * blow * 256 / steps / 3);
    factor(w, PLANT_KDB, diode * blow * 256 / steps / root);
    factor(w, PLANT_KSA, knee * blow * 256 / steps / 3);
    factor(w, PLANT_KSB, knee * blow * 256 / steps / root);
    factor(w, PLANT_KN, 64 / steps);
    factor(w, PLANT_KX, HOLD_SHARE * 1.5 * least_h / b->step_s * b->a / b->v);
    factor(w, PLANT_KXA, blow * 2 / 3);
    factor(w, PLANT_KXH, blow / 3);
    factor(w, PLANT_KXB, blow / root);
    number(w, PLANT_VD, diode);
    number(w, PLANT_U, v->vbus_v / b->v);
    number(w, PLANT_VS, v->vbus_v / b->v);
    factor(w, PLANT_KI, 128 / steps * b->step_s / v->bus_capacitance_f * b->a / b->v);
    factor(w, PLANT_KSR,
           v->supply_resistance_ohm > 0 ? fmin(0.5, b->step_s / (v->bus_capacitance_f * v->supply_resistance_ohm))
                                        : 0.5);
    factor(w, PLANT_KCH, v->chopper_ohm > 0 ? b->step_s / (v->bus_capacitance_f * v->chopper_ohm) : 0);
}

static void machine(struct plant_words *w, const struct plant_params *p)
{
    const struct motor_params *m = &p->motor;
    const struct plant_bases *b = &w->base;
    double ohm = m->resistance_ohm * (1 + m->copper_tempco_per_k * (m->ambient_c + m->winding_rise_k - REFERENCE_C));
    double flux =
        m->flux_wb * (1 + m->magnet_tempco_per_k * (m->ambient_c + m->magnet_share * m->winding_rise_k - REFERENCE_C));
    double angle = m->pole_pairs * m->initial_angle_rad;
    factor(w, PLANT_KR, b->step_s * (ohm + p->inverter.r_on_ohm) * b->a / b->vs);
    factor(w, PLANT_GD, b->vs / (m->ld_h * b->a));
    factor(w, PLANT_GQ, b->vs / (m->lq_h * b->a));
    number(w, PLANT_PF, flux / b->vs);
    number(w, PLANT_PFN, -flux / b->vs);
    factor(w, PLANT_KSAL, (m->ld_h - m->lq_h) * b->a / b->vs);
    factor(w, PLANT_KE, m->pole_pairs * flux * b->rad_s / b->v);
    number(w, PLANT_FA, flux / b->vs * cos(angle));
    number(w, PLANT_FB, flux / b->vs * sin(angle));
    for (int k = 0; k < 3; k++) {
        static const int zero[] = {PLANT_IA, PLANT_IB, PLANT_IC};
        set(w, zero[k], 0);
    }
    set(w, PLANT_IBETA, 0);
    set(w, PLANT_ID, 0);
    set(w, PLANT_IQ, 0);
    set(w, PLANT_EA, 0);
    set(w, PLANT_EB, 0);
    set(w, PLANT_EC, 0);
    set(w, PLANT_W, 0);
    set(w, PLANT_D, 0);
}

static void shaft(struct plant_words *w, const struct plant_params *p)
{
    const struct motor_params *m = &p->motor;
    const struct plant_bases *b = &w->base;
    double turn = m->initial_angle_rad / TWO_PI, lines = p->sensors.encoder_counts / 4;
    factor(w, PLANT_KB, (m->friction_viscous_nms + p->load.viscous_nms) * b->rad_s / b->nm);
    factor(w, PLANT_KF, p->load.fan_nms2 * b->rad_s * b->rad_s / b->nm);
    number(w, PLANT_FRIC, (m->friction_coulomb_nm + p->load.coulomb_nm) / b->nm);
    factor(w, PLANT_KC, m->cogging_nm / b->nm);
    whole(w, PLANT_NCOG, m->cogging_per_rev * 256, 0);
    set(w, PLANT_CPH, plant_angle(m->cogging_rad / TWO_PI));
    factor(w, PLANT_KTH, b->rad_s * b->step_s / TWO_PI * ANGLE_UNIT / 65536);
    whole(w, PLANT_M1, 512, 10);
    whole(w, PLANT_MP, 512 * m->pole_pairs, 10);
    whole(w, PLANT_ML, 4 * lines, 3);
    factor(w, PLANT_MI, lines * 512 / PLANT_STEP_CLOCKS / 262144);
    set(w, PLANT_THM, plant_angle(turn));
    set(w, PLANT_THE, plant_angle(turn * m->pole_pairs));
    set(w, PLANT_THQ, plant_angle(turn * lines));
}

void plant_words_shaft(struct plant_words *w, const struct motor *m)
{
    const struct plant_bases *b = &w->base;
    double inertia_kgm2 = m->p.inertia_kgm2 + m->load.inertia_kgm2;
    bool moves = m->shaft == SHAFT_FREE;
    number(w, PLANT_TLN, -(m->load_nm + m->hoist_nm) / b->nm);
    factor(w, PLANT_KW, moves ? b->step_s * b->nm / (inertia_kgm2 * b->rad_s) : 0);
}

static void sensors(struct plant_words *w, const struct plant_params *p)
{
    const struct sensor_params *s = &p->sensors;
    const double gain[3] = {s->i_gain_a, s->i_gain_b, s->i_gain_c};
    const double offset[3] = {s->i_offset_a_lsb, s->i_offset_b_lsb, s->i_offset_c_lsb};
    static const int to_gain[3] = {PLANT_GA, PLANT_GB, PLANT_GC}, to_offset[3] = {PLANT_OA, PLANT_OB, PLANT_OC};
    for (int k = 0; k < 3; k++) {
        factor(w, to_gain[k], 0.5 * w->base.a / s->i_range_a * gain[k]);
        number(w, to_offset[k], 0.5 + (offset[k] + 0.5) / 4096);
    }
    factor(w, PLANT_GU, w->base.v / s->v_range_v);
    double lines = s->encoder_counts / 4, index = s->index_angle_rad / TWO_PI;
    double count = floor((index - floor(index)) * s->encoder_counts);
    w->index = (uint32_t)((int64_t)count & 3) << 18 |
               (uint32_t)(rounded((count + 0.5) / s->encoder_counts * 262144) & 0x3FFFF);
    w->reach = (uint32_t)floor(0.5 / lines * 262144);
    w->hall = (uint32_t)(rounded(s->hall_angle_rad / TWO_PI * 262144) & 0x3FFFF);
    double noise = s->i_noise_lsb;
    uint32_t strength = noise <= 0.1 ? 0 : noise < 0.45 ? 1 : noise < 0.9 ? 2 : 3;
    w->control = 1u | (p->inverter.supply_sinks != 0 ? 2u : 0u) | (p->inverter.switch_v > 0 ? 4u : 0u) | strength << 3;
}

static uint32_t clocks(double delay_s)
{
    double n = delay_s / CLOCK_S;
    return n > 255 ? 255 : (uint32_t)rounded(n);
}

void plant_words_make(struct plant_words *w, const struct plant_params *p)
{
    memset(w, 0, sizeof *w);
    w->base = bases_of(p);
    constants(w);
    bridge(w, p);
    machine(w, p);
    shaft(w, p);
    sensors(w, p);
    struct motor at_rest = {.p = p->motor, .load = p->load, .shaft = SHAFT_FREE};
    plant_words_shaft(w, &at_rest);
    w->delay = clocks(p->inverter.turn_on_delay_s) | clocks(p->inverter.turn_off_delay_s) << 8;
}

const char *plant_words_lack(const struct plant_params *p)
{
    const struct motor_params *m = &p->motor;
    if (m->sat_a_d0 != 0) {
        return "saturation";
    }
    if (m->emf_5 != 0 || m->emf_7 != 0 || m->permeance_6 != 0) {
        return "harmonics, permeance";
    }
    if (m->cogging2_nm != 0 || m->iron_eddy_nms != 0 || m->iron_hysteresis_nm != 0) {
        return "second cogging, iron";
    }
    if (p->load.stiffness_nm_rad != 0) {
        return "shaft";
    }
    if (p->inverter.coss_c != 0 || p->inverter.switching_s != 0) {
        return "edges, switching";
    }
    if (p->sensors.shunt != 0 || p->sensors.amp_hz != 0 || p->sensors.ring_lsb != 0) {
        return "shunts, amplifier, ringing";
    }
    return NULL;
}

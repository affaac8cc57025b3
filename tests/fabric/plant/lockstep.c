/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The plant in RTL and the C plant under the same gates, open loop: a voltage whose angle goes on by itself.
 *
 *   lockstep CONFIG SECONDS SPEED_RAD_S LOAD_NM [EFFECT]
 *
 * Its speed rises to SPEED_RAD_S (mechanical) in a third of the time, at half of it LOAD_NM begins to pull; EFFECT "off" turns
 * all gates off at two thirds. Prints the largest differences of the last third as "i_a A", "speed RAD_S", "angle DEGREES"
 * (electrical) and "bus V", then the speeds at the end. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "config.h"
#include "plant_words.h"
#include "rtl_plant.h"

#define PERIOD      5000 /* clocks */
#define DEAD        50
#define CLOCK_PS    10000
#define TWO_PI      6.283185307179586
#define WORD_ONE    17179869184.0
#define CONTROL     0x04
#define DELAY       0x0C
#define IN_RAD(deg) ((deg)*TWO_PI / 360)

static struct config config;

struct pair {
    struct inverter inverter;
    struct motor motor;
    struct rtl_plant *rtl;
    struct rtl_plant_in pins;
    struct plant_words words;
    int64_t clock;
    double i_a[3]; /* of the C plant when the RTL took its legs */
    double worst_a, worst_rad_s, worst_deg, worst_v;
    bool measures;
};

static double value(const struct pair *p, int place)
{
    return (double)rtl_plant_get(p->rtl, place) / WORD_ONE;
}

static void larger(double *worst, double x)
{
    *worst = fabs(x) > *worst ? fabs(x) : *worst;
}

static double angle_error_deg(const struct pair *p)
{
    double turns =
        p->motor.p.pole_pairs * p->motor.theta_rad / TWO_PI - (double)rtl_plant_get(p->rtl, PLANT_THE) / (4 * WORD_ONE);
    return 360 * (turns - floor(turns + 0.5));
}

static void compare(struct pair *p)
{
    int phase = rtl_plant_phase(p->rtl);
    if (phase == 98) {
        motor_currents(&p->motor, p->i_a);
    } else if (phase == 0 && p->measures) {
        larger(&p->worst_deg, angle_error_deg(p));
        larger(&p->worst_rad_s, value(p, PLANT_W) * p->words.base.rad_s - p->motor.speed_rad_s);
        larger(&p->worst_v, value(p, PLANT_U) * p->words.base.v - p->inverter.bus_v);
    }
}

static void compare_currents(struct pair *p, const double i_a[3])
{
    static const int place[3] = {PLANT_IA, PLANT_IB, PLANT_IC};
    for (int k = 0; k < 3 && p->measures; k++) {
        larger(&p->worst_a, value(p, place[k]) * p->words.base.a - i_a[k]);
    }
}

static void advance_c(struct pair *p, sim_ps to)
{
    for (sim_ps now = p->clock * CLOCK_PS; now < to;) {
        inverter_switch(&p->inverter, now);
        sim_ps next = inverter_next_switch(&p->inverter), until = next < to ? next : to;
        now = until > now ? inverter_advance(&p->inverter, &p->motor, now, until) : now;
        if (until <= now && next <= now) {
            inverter_switch(&p->inverter, now);
        }
    }
}

/* Both, to that clock, with the gates as they are; looks only in the window that is asked for. */
static void advance(struct pair *p, int64_t to, bool looks)
{
    static double taken_a[3];
    while (p->clock < to) {
        int64_t until = to;
        if (looks) { /* to the next clock in which something is to be compared: 98, 0, 10 */
            int phase = rtl_plant_phase(p->rtl);
            int left = phase < 10 ? 10 - phase : phase < 98 ? 98 - phase : 100 - phase;
            until = p->clock + left < to ? p->clock + left : to;
        }
        advance_c(p, until * CLOCK_PS);
        rtl_plant_clocks(p->rtl, &p->pins, (uint64_t)(until - p->clock));
        p->clock = until;
        int phase = rtl_plant_phase(p->rtl);
        if (looks && phase == 10) {
            compare_currents(p, taken_a);
        } else if (looks && phase == 98) {
            memcpy(taken_a, p->i_a, sizeof taken_a);
            compare(p);
        } else if (looks) {
            compare(p);
        }
    }
}

static void gates(struct pair *p, unsigned high, unsigned low)
{
    unsigned all = 0;
    for (int k = 0; k < 3; k++) {
        all |= ((high >> k) & 1) << (2 * k) | ((low >> k) & 1) << (2 * k + 1);
    }
    p->pins.gate_high = (uint8_t)high;
    p->pins.gate_low = (uint8_t)low;
    inverter_command(&p->inverter, all, p->clock * CLOCK_PS);
}

/* A period with the high sides on in its middle; dead time before each side. */
static void period(struct pair *p, const double duty[3], bool on, bool looks)
{
    int64_t begin = p->clock;
    unsigned high = 0, low = 0;
    gates(p, 0, on ? 7 : 0);
    if (!on) {
        advance(p, begin + PERIOD, looks);
        return;
    }
    low = 7;
    int64_t at[3][4];
    for (int k = 0; k < 3; k++) {
        int64_t half = (int64_t)(duty[k] * PERIOD / 2);
        half = half < 2 * DEAD ? 2 * DEAD : half > PERIOD / 2 - 2 * DEAD ? PERIOD / 2 - 2 * DEAD : half;
        at[k][0] = begin + PERIOD / 2 - half - DEAD;
        at[k][1] = at[k][0] + DEAD;
        at[k][2] = begin + PERIOD / 2 + half - DEAD;
        at[k][3] = at[k][2] + DEAD;
    }
    for (;;) {
        int64_t next = begin + PERIOD;
        for (int k = 0; k < 3; k++) {
            for (int n = 0; n < 4; n++) {
                next = at[k][n] > p->clock && at[k][n] < next ? at[k][n] : next;
            }
        }
        advance(p, next, looks);
        if (next == begin + PERIOD) {
            return;
        }
        for (int k = 0; k < 3; k++) {
            unsigned bit = 1u << k;
            low = next == at[k][0] ? low & ~bit : next == at[k][3] ? low | bit : low;
            high = next == at[k][1] ? high | bit : next == at[k][2] ? high & ~bit : high;
        }
        gates(p, high, low);
    }
}

static void configure(struct pair *p)
{
    for (int n = 0; n < PLANT_WORDS; n++) {
        rtl_plant_put(p->rtl, n, p->words.word[n]);
    }
    rtl_plant_write(p->rtl, DELAY, p->words.delay);
    rtl_plant_write(p->rtl, CONTROL, p->words.control & ~0x18u);
    while (rtl_plant_phase(p->rtl) != 0) {
        rtl_plant_clocks(p->rtl, &p->pins, 1);
    }
}

static void load(struct pair *p, double nm)
{
    p->motor.load_nm = nm;
    plant_words_shaft(&p->words, &p->motor);
    rtl_plant_put(p->rtl, PLANT_TLN, p->words.word[PLANT_TLN]);
}

int main(int argc, char **argv)
{
    if (argc != 5 && argc != 6) {
        fputs("lockstep CONFIG SECONDS SPEED_RAD_S LOAD_NM [off]\n", stderr);
        return 2;
    }
    config_load(&config, argv[1], false);
    double end_s = atof(argv[2]), speed_rad_s = atof(argv[3]), load_nm = atof(argv[4]);
    bool turns_off = argc == 6 && strcmp(argv[5], "off") == 0;
    struct pair p = {.rtl = rtl_plant_new(),
                     .pins = {.cs_n = true, .sclk = true, .temp_cs_n = true, .temp_sclk = true}};
    struct plant_params *params = &config.axis[0].plant;
    const char *lack = plant_words_lack(params);
    if (lack) {
        fprintf(stderr, "lockstep: the plant in RTL has no %s\n", lack);
        return 1;
    }
    inverter_init(&p.inverter, &params->inverter);
    motor_init(&p.motor, &params->motor, &params->load);
    plant_words_make(&p.words, params);
    configure(&p);
    const struct motor_params *m = &params->motor;
    double angle = m->pole_pairs * m->initial_angle_rad, bus_v = params->inverter.vbus_v;
    bool loaded = false;
    for (double t_s = 0; t_s < end_s; t_s = (double)p.clock * 1e-8) {
        double share = t_s / (end_s / 3), w = m->pole_pairs * speed_rad_s * (share < 1 ? share : 1);
        double boost_v = m->resistance_ohm * 0.5 * params->sensors.i_range_a * 0.5;
        double v = (boost_v + fabs(w) * m->flux_wb) / bus_v, duty[3];
        angle += w * PERIOD * 1e-8;
        for (int k = 0; k < 3; k++) {
            duty[k] = 0.5 + v * cos(angle + IN_RAD(60) - k * IN_RAD(120));
        }
        if (!loaded && t_s >= end_s / 2) {
            load(&p, load_nm);
            loaded = true;
        }
        bool on = !(turns_off && t_s >= 2 * end_s / 3);
        bool looks = t_s >= 2 * end_s / 3;
        period(&p, duty, on, looks);
        p.measures = looks; /* behind the first period of them */
    }
    printf("i_a %.6g\nspeed %.6g\nangle %.6g\nbus %.6g\nis_speed %.9g\nrtl_speed %.9g\n", p.worst_a, p.worst_rad_s,
           p.worst_deg, p.worst_v, p.motor.speed_rad_s, value(&p, PLANT_W) * p.words.base.rad_s);
    return 0;
}

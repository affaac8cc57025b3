/* SPDX-License-Identifier: MIT */
/* Quick, and the same to the bit on every machine: sums, products and quotients alone; a step each PWM period. */
#include "swarm.h"

#define SUPPLY_V   24.0
#define PAIRS      4
#define R_OHM      0.36
#define L_H        200e-6
#define FLUX_WB    6.395e-3
#define J_KGM2     5.6493e-5
#define DRAG_NM    3e-3 /* Coulomb */
#define DRAG_NMS   1e-5
#define RANGE_A    23.571
#define RANGE_V    57.528
#define PERIOD_S   50e-6
#define SUBSTEPS   2
#define HALF       2500.0 /* compares of half a period */
#define CLOCKS     5000   /* of a period */
#define DEAD_SHARE 0.02   /* 1 us of 50 */
#define KNEE_A     0.1
#define TWO_PI     6.283185307179586
#define INDEX_AT   0.3 /* of a turn */
#define ZERO_Q15   32768
#define STILL      1e-3

#define SET(reg, value) (*(volatile uint32_t *)(uintptr_t) & (reg) = (uint32_t)(value))

static int64_t floor_of(double x)
{
    const int64_t n = (int64_t)x;
    return (double)n > x ? n - 1 : n;
}

/* Both, of an angle in turns: a quarter turn by Taylor's series around its middle. */
static void cossin(double turns, double *c, double *s)
{
    const double x = (turns - (double)floor_of(turns)) * 4;
    const int quarter = (int)x;
    const double a = (x - quarter - 0.5) * (TWO_PI / 4), a2 = a * a, half = 0.70710678118654752;
    const double sine = a * (1 - a2 / 6 * (1 - a2 / 20 * (1 - a2 / 42 * (1 - a2 / 72))));
    const double cosine = 1 - a2 / 2 * (1 - a2 / 12 * (1 - a2 / 30 * (1 - a2 / 56)));
    const double cq = half * (cosine - sine), sq = half * (cosine + sine);
    *c = quarter == 0 ? cq : quarter == 1 ? -sq : quarter == 2 ? -cq : sq;
    *s = quarter == 0 ? sq : quarter == 1 ? cq : quarter == 2 ? -sq : -cq;
}

static double within(double x, double most)
{
    return x > most ? most : x < -most ? -most : x;
}

void plant_init(struct plant *p)
{
    *p = (struct plant){.vbus_v = SUPPLY_V, .duty = {0.5, 0.5, 0.5}, .turns = 0.113, .noise = 2463534242u};
}

static int32_t noise(struct plant *p)
{
    p->noise ^= p->noise << 13;
    p->noise ^= p->noise >> 17;
    p->noise ^= p->noise << 5;
    return (int32_t)(p->noise % 33u) - 16;
}

static void phase_currents(const struct plant *p, double i[3])
{
    double c, s;
    cossin(p->turns * PAIRS, &c, &s);
    const double alpha = p->i_d_a * c - p->i_q_a * s, beta = p->i_d_a * s + p->i_q_a * c;
    i[0] = alpha;
    i[1] = -alpha / 2 + beta * 0.86602540378443865;
    i[2] = -i[0] - i[1];
}

static void currents(struct plant *p, double v_alpha, double v_beta, double dt_s)
{
    double c, s;
    cossin((p->turns + p->w_rad_s / TWO_PI * dt_s / 2) * PAIRS, &c, &s);
    const double v_d = v_alpha * c + v_beta * s, v_q = v_beta * c - v_alpha * s, w = p->w_rad_s * PAIRS;
    const double d = (v_d - R_OHM * p->i_d_a + w * L_H * p->i_q_a) / L_H;
    const double q = (v_q - R_OHM * p->i_q_a - w * (L_H * p->i_d_a + FLUX_WB)) / L_H;
    p->i_d_a += d * dt_s;
    p->i_q_a += q * dt_s;
}

static void turn(struct plant *p, double dt_s)
{
    const double drag = DRAG_NM + p->load_mnm / 1e3;
    p->torque_nm = 1.5 * PAIRS * FLUX_WB * p->i_q_a;
    const bool stands = p->w_rad_s < STILL && p->w_rad_s > -STILL;
    if (p->blocked || (stands && p->torque_nm < drag && p->torque_nm > -drag)) {
        p->w_rad_s = 0;
        return;
    }
    const bool forward = stands ? p->torque_nm > 0 : p->w_rad_s > 0;
    const double before = p->w_rad_s;
    p->w_rad_s += (p->torque_nm - (forward ? drag : -drag) - DRAG_NMS * p->w_rad_s) / J_KGM2 * dt_s;
    p->w_rad_s = before * p->w_rad_s < 0 ? 0 : p->w_rad_s;
    p->turns += p->w_rad_s / TWO_PI * dt_s;
}

static void live_period(struct plant *p)
{
    for (int n = 0; n < SUBSTEPS; n++) {
        double i[3], v[3];
        phase_currents(p, i);
        for (int k = 0; k < 3; k++) {
            v[k] = (p->duty[k] - DEAD_SHARE * within(i[k] / KNEE_A, 1)) * p->vbus_v;
        }
        currents(p, (2 * v[0] - v[1] - v[2]) / 3, (v[1] - v[2]) * 0.57735026918962576, PERIOD_S / SUBSTEPS);
        turn(p, PERIOD_S / SUBSTEPS);
    }
}

/* ---- what is seen ---- */

static int32_t clamped(double x, int32_t least, int32_t most)
{
    return x < least ? least : x > most ? most : (int32_t)floor_of(x + 0.5);
}

static void show_currents(struct plant *p, struct fabric *f)
{
    double i[3];
    const uint32_t zero[3] = {f->adc.OFFSET_A, f->adc.OFFSET_B, f->adc.OFFSET_C};
    int32_t q15[3];
    phase_currents(p, i);
    for (int k = 0; k < 3; k++) {
        const double at = i[k] / RANGE_A * 32768 + (k == 0 ? p->offset_q15 : 0) + noise(p);
        q15[k] = clamped(at + ZERO_Q15 - zero[k], -32767, 32767);
    }
    SET(f->adc.IA, q15[0]);
    SET(f->adc.IB, q15[1]);
    SET(f->adc.IC, q15[2]);
    SET(f->adc.VBUS, clamped(p->vbus_v / RANGE_V * 32768, 0, 32760));
    SET(f->adc.TEMP, ADC_TEMP_CODE_AT_0_C + 25 * ADC_TEMP_CODES_PER_K);
    SET(f->adc.VALID, 7);
    const int32_t sum = q15[0] + q15[1] + q15[2], trip = (int32_t)f->adc.I_TRIP, most = (int32_t)f->adc.SUM_TRIP;
    bool beyond = false;
    for (int k = 0; k < 3; k++) {
        beyond = beyond || q15[k] > trip || q15[k] < -trip;
    }
    f->adc.STATUS = ADC_STATUS_EOC | (beyond ? ADC_STATUS_CURRENT : 0u) |
                    (sum > most || sum < -most ? ADC_STATUS_SUM : 0u) |
                    ((uint32_t)f->adc.VBUS < f->adc.V_MIN ? ADC_STATUS_VBUS_LOW : 0u) |
                    ((uint32_t)f->adc.VBUS > f->adc.V_MAX ? ADC_STATUS_VBUS_HIGH : 0u);
}

/* Clocks since the last of so many edges a turn, if one lies within this period; else as before. */
static uint32_t edge_time(double turns, double edges, double moved, uint32_t now, uint32_t before)
{
    const double at = turns * edges, past = moved > 0 ? at - (double)floor_of(at) : (double)floor_of(at) + 1 - at;
    const double way = moved * edges > 0 ? moved * edges : -moved * edges;
    return past >= way ? before : now - (uint32_t)(past / way * CLOCKS);
}

static void show_rotor(struct plant *p, struct fabric *f, double moved)
{
    static const uint8_t states[6] = {5, 1, 3, 2, 6, 4};
    const int32_t turn_counts = (int32_t)f->encoder.COUNTS;
    const uint32_t now = f->encoder.LATCH_TIME + CLOCKS;
    SET(f->encoder.LATCH_TIME, now);
    if (moved != 0) {
        SET(f->encoder.HALL_TIME, edge_time(p->turns, 6 * PAIRS, moved, now, f->encoder.HALL_TIME));
    }
    const double electrical = p->turns * PAIRS - (double)floor_of(p->turns * PAIRS);
    SET(f->encoder.HALL, states[(int)(electrical * 6)] * 9u);
    f->encoder.STATUS |= p->encoder == ENCODER_SILENT  ? ENCODER_STATUS_SIGNAL_LOST
                         : p->encoder == ENCODER_JUMPS ? ENCODER_STATUS_ILLEGAL
                                                       : 0u;
    if (turn_counts == 0 || p->encoder == ENCODER_STANDS) {
        return;
    }
    const int32_t counts = (int32_t)floor_of(p->turns * turn_counts);
    if (counts != p->counts) {
        SET(f->encoder.EDGE_TIME, edge_time(p->turns, turn_counts, moved, now, f->encoder.EDGE_TIME));
        p->counts = counts;
    }
    const double index = (double)floor_of(p->turns - INDEX_AT) + INDEX_AT;
    const double passed = moved > 0 ? p->turns - index : index + 1 - p->turns;
    if (moved != 0 && passed <= (moved > 0 ? moved : -moved)) {
        const int32_t at = (int32_t)floor_of((moved > 0 ? index : index + 1) * turn_counts) - p->zero;
        SET(f->encoder.INDEX, (at % turn_counts + turn_counts) % turn_counts);
        f->encoder.STATUS |= ENCODER_STATUS_INDEX_SEEN;
    }
    const int32_t at = ((counts - p->zero) % turn_counts + turn_counts) % turn_counts;
    SET(f->encoder.LATCHED, at);
    SET(f->encoder.POSITION, at);
}

void plant_gate(struct plant *p, struct fabric *f)
{
    const uint32_t latches = (f->gate.STATUS & GATE_STATUS_LATCHES) | (uint32_t)p->latches;
    f->gate.CONTROL = latches != 0u ? 0u : f->gate.CONTROL;
    const bool lost = (f->encoder.STATUS & (ENCODER_STATUS_ILLEGAL | ENCODER_STATUS_SIGNAL_LOST)) != 0u;
    const uint32_t limits = ADC_STATUS_CURRENT | ADC_STATUS_SUM | ADC_STATUS_VBUS_LOW | ADC_STATUS_VBUS_HIGH;
    f->gate.STATUS = latches | (f->gate.CONTROL != 0u ? GATE_STATUS_LIVE : 0u) | (lost ? GATE_STATUS_ENCODER : 0u) |
                     ((f->adc.STATUS & limits) != 0u ? GATE_STATUS_LIMIT : 0u);
}

void plant_period(struct plant *p, struct fabric *f)
{
    const double before = p->turns;
    const uint32_t compares[3] = {f->pwm.COMPARE_A, f->pwm.COMPARE_B, f->pwm.COMPARE_C};
    plant_gate(p, f);
    if ((f->gate.STATUS & GATE_STATUS_LIVE) != 0u) {
        live_period(p);
    } else {
        p->i_d_a *= 0.1;
        p->i_q_a *= 0.1;
        turn(p, PERIOD_S);
    }
    p->vbus_v += ((world.supply_mv != 0 ? world.supply_mv / 1e3 : SUPPLY_V) - p->vbus_v) * 0.02;
    for (int k = 0; k < 3; k++) {
        p->duty[k] = compares[k] / HALF;
    }
    SET(f->adc.SEQUENCE, f->adc.SEQUENCE + 1u);
    show_currents(p, f);
    show_rotor(p, f, p->turns - before);
    plant_gate(p, f);
}

void plant_short(struct plant *p, struct fabric *f, double seconds)
{
    p->i_d_a = p->i_q_a = 0;
    currents(p, 0, 0, seconds / 2);
    currents(p, 0, 0, seconds / 2);
    show_currents(p, f);
    f->adc.STATUS = ADC_STATUS_EOC;
    p->i_d_a = p->i_q_a = 0;
}

void plant_encoder_begins(struct plant *p, struct fabric *f)
{
    p->counts = p->zero = (int32_t)floor_of(p->turns * (int32_t)f->encoder.COUNTS);
    SET(f->encoder.LATCHED, 0);
    SET(f->encoder.POSITION, 0);
}

uint32_t plant_angle_q32(const struct plant *p)
{
    const double electrical = p->turns * PAIRS;
    return (uint32_t)((electrical - (double)floor_of(electrical)) * 4294967296.0);
}

double plant_rpm(const struct plant *p)
{
    return p->w_rad_s / TWO_PI * 60;
}

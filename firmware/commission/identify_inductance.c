/* SPDX-License-Identifier: MIT */
/*
 * Finds the axes and the inductance along each, at standstill, for small changes about a current that holds the rotor. Bursts
 * along 16 angles over half a turn find the axes wherever the rotor rests: saliency.h has the equations. Then come bursts
 * along each of the two axes.
 *
 * From one sample to the next the current of a winding changes by
 *
 *     i+ - i = b u - a i,   a = 1 - exp(-x),  b = a / R,  x = R T / L
 *
 * and a regression on both gives b. With the resistance known, L = R T / -ln(1 - b R).
 *
 * The magnets' axis is the one they were pulled along, as long as it is magnets that pull. If one inductance is twice the
 * other, reluctance may turn the magnets away; then the axis of the smaller one is taken, as in every machine whose magnets
 * lie across the path of the q flux. Such a rotor is not held, since the current would turn it; it is measured at rest.
 */
#include "firmware/commission/identify_parts.h"
#include "firmware/settings/config.h"
#include "firmware/settings/scale.h"
#include "lib/polar.h"
#include "lib/q15.h"
#include "lib/trig.h"

#define STEP_Q32            (0x80000000u / IDENTIFY_AXES)
#define BURSTS_ANGLE        4u
#define BURSTS_AXIS         64u
#define QUARTER_Q32         0x40000000u
#define PULLED_Q32          ((IDENTIFY_ANGLES - 1u) * 0x2AAAAAABu)
#define STAND_TENTHS        6
#define UNCOMPENSATED_SHIFT 31u
#define RISE_MS             50
#define SETTLE_MS           150u

/* Part of the inductance that slots may make vary with the angle. */
#define SLOTS_PERMILLE 20

/* The same for a machine that is not held: around zero current the dead-time error is not constant. */
#define FREE_PERMILLE 25

/* Reluctance turned the rotor at each step of the current that measured the resistance, so the EMF is in the resistance too. */
#define TURNED_TIMES 3

/* Of the rated current: largest amplitude of the wave on top of the holding current. */
#define WAVE_PART 6

/* ---- measuring ---- */

/*
 * A constant current along the last angle of the resistance test, one phase's, holds the rotor there; half of it flows in
 * each of the other two, more than the wave's amplitude. Or there is none. Nothing is compensated: the dead-time error then
 * depends only on the signs of the phase currents.
 */
static void stand(struct identify *d, volatile struct current_loop *c, bool held)
{
    const int32_t i_q15 = d->i_rated_q15 * STAND_TENTHS / 10;
    d->burst.field_q32 = PULLED_Q32;
    current_loop_field(c, PULLED_Q32, 0);
    c->i_d_ref_q15 = held ? i_q15 * q15_min((int32_t)d->ms, RISE_MS) / RISE_MS : 0;
    c->dead_shift = UNCOMPENSATED_SHIFT;
}

void identify_axes_add(struct identify_axes_sums *s, uint32_t angle_q32, int32_t along, int32_t across)
{
    const cossin_t twice = cossin_q15(2u * angle_q32);
    s->re += (int64_t)along * twice.cos - (int64_t)across * twice.sin;
    s->im += (int64_t)along * twice.sin + (int64_t)across * twice.cos;
    s->straight += (int64_t)along * 32768;
}

/* Adds this angle's part to the sums. */
static void keep(struct identify_axes *m, uint32_t angle_q32)
{
    identify_axes_add(&m->sums[m->pass], angle_q32, m->this_d, m->this_q);
    m->this_d = m->this_q = 0;
    m->burst = 0;
    m->angle++;
}

/* One pass with the rotor held, one with it free; a rotor that reluctance would turn is not held at all. */
bool identify_measure_axes(struct identify *d, volatile struct current_loop *c, const struct adc_regs *adc)
{
    struct identify_axes *const m = &d->axes;
    struct burst *const b = &d->burst;
    if (d->ms == 1u && m->pass == IDENTIFY_HELD) {
        *m = (struct identify_axes){.pass = d->reluctant ? IDENTIFY_FREE : IDENTIFY_HELD, .free_steps = b->v_steps};
    }
    stand(d, c, m->pass == IDENTIFY_HELD);
    if (d->ms <= SETTLE_MS) {
        return false;
    }
    struct burst_sums s = {0};
    b->angle_q32 = m->angle * STEP_Q32;
    burst_play(b, c, adc);
    if (m->angle + m->burst + m->pass == 0u && burst_peak_q15(b) * WAVE_PART > d->i_rated_q15 && b->v_steps > 1) {
        b->v_steps /= 2; /* dead time acted against the first pulses */
        return false;
    }
    burst_add(&s, b, c->vbus_q15);
    m->this_d += s.ud;
    m->this_q += s.uq;
    m->burst++;
    if (m->burst == BURSTS_ANGLE) {
        keep(m, b->angle_q32);
    }
    if (m->angle == IDENTIFY_AXES) {
        m->angle = 0;
        m->pass++;
        d->axis_counts = d->counts;
        d->ms = 0;
        if (m->pass == IDENTIFY_FREE) {
            m->held_steps = b->v_steps;
        }
        b->v_steps = m->free_steps; /* large enough despite dead time */
    }
    return m->pass == IDENTIFY_PASSES;
}

/* Alternates d and q, and the halves. */
bool identify_measure_inductance(struct identify *d, volatile struct current_loop *c, const struct adc_regs *adc)
{
    struct identify_inductance *const m = &d->inductance;
    struct burst *const b = &d->burst;
    if (d->ms == 1u) {
        *m = (struct identify_inductance){0};
    }
    stand(d, c, !d->reluctant);
    if (d->ms <= SETTLE_MS) {
        return false;
    }
    const uint32_t axis = m->bursts % 2u, half = m->bursts / 2u % 2u;
    b->angle_q32 = d->axis_q32 + axis * QUARTER_Q32;
    burst_play(b, c, adc);
    burst_add(&m->sums[axis][half], b, c->vbus_q15);
    m->bursts++;
    return m->bursts == 2u * BURSTS_AXIS;
}

/* ---- evaluation ---- */

static int32_t narrow(int64_t value, int64_t largest)
{
    while (largest > INT32_MAX / 4) {
        largest /= 2;
        value /= 2;
    }
    return (int32_t)value;
}

static int64_t size_of(const struct identify_axes_sums *m)
{
    return m->straight < 0 ? -m->straight : m->straight;
}

/* The angle with the largest current response; half a turn away is the same. */
static uint32_t easy_q32(const struct identify_axes_sums *m)
{
    return atan2_q32(narrow(m->im, size_of(m)), narrow(m->re, size_of(m))) / 2u;
}

bool identify_doubled(const struct identify_axes_sums *m)
{
    const int64_t straight = size_of(m);
    const int32_t re = narrow(m->re, straight), im = narrow(m->im, straight);
    const int64_t salient = identify_root((int64_t)re * re + (int64_t)im * im);
    return 3 * salient > narrow(straight, straight); /* Y1 by Y0: (2 - 1) / (2 + 1) */
}

bool identify_think_axes(struct identify *d)
{
    const uint32_t held_q32 = easy_q32(&d->axes.sums[IDENTIFY_HELD]);
    const uint32_t free_q32 = easy_q32(&d->axes.sums[IDENTIFY_FREE]);
    d->reluctant = identify_doubled(&d->axes.sums[IDENTIFY_FREE]);
    d->burst.v_steps = d->reluctant ? d->axes.free_steps : d->axes.held_steps;
    const uint32_t off_q32 = (held_q32 - PULLED_Q32 + QUARTER_Q32 / 2u) % (2u * QUARTER_Q32);
    const bool along = off_q32 < QUARTER_Q32;
    if (d->reluctant && d->results[IDENTIFY_RESISTANCE].state == IDENTIFY_KNOWN) {
        d->results[IDENTIFY_RESISTANCE].interval *= TURNED_TIMES;
        identify_refuse(d, IDENTIFY_DEAD_TIME, IDENTIFY_TURNED);
    }
    d->axis_q32 = d->reluctant ? free_q32 : along ? held_q32 : held_q32 + QUARTER_Q32;
    return true;
}

/* nH, or 0 if no current responds. */
int64_t identify_inductance_nh(const struct identify *d, const struct burst_sums *s)
{
    /* regression: b = (ud ii - id ui) / (count ii - ui^2), in Q15 of current for one wave's height */
    const int64_t below = s->count * s->ii - (int64_t)s->ui * s->ui;
    const int64_t above = s->ud * s->ii - s->id * s->ui;
    if (below <= 0 || above <= 0) {
        return 0;
    }
    const int64_t change_256ths = identify_scaled(above, 256, below);
    const int64_t vbus_q15 = scale(s->vbus_q15, 1, s->bursts);
    const int64_t u_uv =
        identify_scaled(vbus_q15 * d->burst.v_steps, d->params.v_range_mv * 1000LL, 32768LL * CONFIG_BUS_STEPS);
    const int64_t i_na = identify_scaled(change_256ths, d->params.i_range_ma * 1000000LL, 256LL * 32768);
    if (i_na <= 0 || u_uv <= 0) {
        return 0;
    }
    const struct identify_result *const r = &d->results[IDENTIFY_RESISTANCE];
    const int64_t r_uohm = r->state == IDENTIFY_KNOWN ? r->value : d->rough_mohm * 1000LL;
    /* y = b R: uohm times nA by uV are 1e-9 */
    const int64_t y_q30 = identify_scaled(identify_scaled(i_na, r_uohm, u_uv), 1LL << 30, 1000000000);
    if (y_q30 >= 1LL << 30) {
        return 0;
    }
    const int64_t x_q30 = identify_log_q30(y_q30);
    return x_q30 < 64 ? identify_scaled(u_uv, 1000000000000LL / CONFIG_PWM_HZ, i_na)
                      : identify_scaled(r_uohm * 1000, 1LL << 30, x_q30 * CONFIG_PWM_HZ);
}

void identify_know_inductance(struct identify *d, enum identify_quantity what, const int64_t halves[2], int64_t bound)
{
    const int64_t a = halves[0], b = halves[1];
    if (a == 0 || b == 0) {
        identify_refuse(d, what, IDENTIFY_NO_CURRENT);
        return;
    }
    const int64_t mean = (a + b) / 2, apart = a > b ? a - b : b - a;
    if (apart * 10 > mean) {
        identify_refuse(d, what, IDENTIFY_SCATTER);
        return;
    }
    /* a wave's amplitude is accurate to half a count on either side; slots make inductances vary with the angle */
    const int64_t height = identify_scaled(mean, 1 << CONFIG_V_SHIFT, 2 * d->burst.v_steps);
    const int64_t slots = scale(mean, SLOTS_PERMILLE, 1000);
    const int64_t gains = scale(mean, IDENTIFY_CURRENT_GAIN_PERMILLE + IDENTIFY_BUS_GAIN_PERMILLE, 1000);
    const int64_t others = identify_root(height * height + slots * slots + bound * bound);
    identify_know(d, what, mean, identify_interval(apart >> 1, gains, others));
}

static void know_axis(struct identify *d, enum identify_quantity what, const struct burst_sums of[2])
{
    const int64_t halves[] = {identify_inductance_nh(d, &of[0]), identify_inductance_nh(d, &of[1])};
    const int64_t free_nh = d->reluctant ? scale((halves[0] + halves[1]) / 2, FREE_PERMILLE, 1000) : 0;
    identify_know_inductance(d, what, halves, free_nh);
}

bool identify_think_inductance(struct identify *d)
{
    know_axis(d, IDENTIFY_LD, d->inductance.sums[0]);
    know_axis(d, IDENTIFY_LQ, d->inductance.sums[1]);
    if (d->told.angle_source != PARAM_ANGLE_ENCODER) {
        identify_refuse_rest(d, IDENTIFY_POLE_PAIRS, IDENTIFY_NO_ENCODER);
        return false;
    }
    return true;
}

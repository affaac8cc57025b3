/* SPDX-License-Identifier: MIT */
/*
 * Finds the axes and the inductance along each, at standstill, for small changes about a current that holds the rotor. Bursts
 * along 16 angles over half a turn find the axes at any rest position: equations in alignment.h. Then bursts along each of the
 * two axes.
 *
 * From one sample to the next the current of a winding changes by
 *
 *     i+ - i = b u - a i,   a = 1 - exp(-x),  b = a / R,  x = R T / L
 *
 * and a regression on both gives b. With the resistance known, L = R T / -ln(1 - b R).
 *
 * The magnets' axis is the one along which the rotor was pulled, if the magnets dominate. If one inductance is twice the other,
 * reluctance may dominate; then the axis of the smaller one is taken, as in machines whose magnets are in the path of the d
 * flux. Such a rotor is measured without a holding current, which would turn it. It may have moved by a slot since the axes
 * were found; so the cross responses are measured, too, and the inductances are those along the axes from these.
 */
#include "firmware/commission/identify_parts.h"
#include "firmware/settings/config.h"

#define STEP_Q32     (0x80000000u / IDENTIFY_AXES)
#define BURSTS_ANGLE 4u
#define BURSTS_AXIS  64u
#define QUARTER_Q32  0x40000000u
#define PULLED_Q32   ((IDENTIFY_ANGLES - 1u) * 0x2AAAAAABu)
#define STAND_TENTHS 6
#define RISE_MS      50
#define SETTLE_MS    150u

/* Variation of the inductance with the angle, by slots. */
#define SLOTS_PERMILLE 20

/* The same for a machine that is not held: around zero current the dead-time error is not constant. */
#define FREE_PERMILLE 25

/* If reluctance turned the rotor at the current steps of the resistance measurement, that contains EMF, too. */
#define TURNED_TIMES 3

/* Of the rated current: maximum amplitude of the wave on top of the holding current. */
#define WAVE_PART 6

/* ---- measuring ---- */

/*
 * A constant current along the last angle of the resistance test, that of a phase, holds the rotor; half of it flows in each of
 * the other two, more than the wave's amplitude. Or no current. Dead time is not compensated: its error then depends only on
 * the signs of the phase currents. True when settled.
 */
static bool settle(const struct identify *d, volatile struct current_loop *c, bool held)
{
    current_loop_field(c, PULLED_Q32, 0);
    current_loop_set_i_d(c, held ? measure_ramp(identify_tenths_q15(d, STAND_TENTHS), d->phase_ms, RISE_MS) : 0);
    current_loop_compensate(c, false);
    return d->phase_ms > SETTLE_MS;
}

/* One phase with the rotor held, one with it free; a rotor that reluctance would turn is not held. */
bool identify_measure_axes(struct identify *d, const struct measure_io *io)
{
    struct identify_axes *const m = &d->work.axes;
    struct burst *const b = &d->burst;
    if (d->ms == 1u) {
        m->free_steps = b->v_steps;
        d->phase = d->reluctant ? IDENTIFY_FREE : IDENTIFY_HELD;
    }
    if (!settle(d, io->loop, d->phase == IDENTIFY_HELD)) {
        return false;
    }
    struct burst_sums s = {0};
    if (m->bursts == 0u) {
        b->v_steps = q15_min(b->v_steps, burst_room_steps(io->loop));
    }
    identify_play(d, io, PULLED_Q32, m->bursts / BURSTS_ANGLE * STEP_Q32);
    if (m->bursts + d->phase == 0u && burst_peak_q15(b) * WAVE_PART > d->i_rated_q15 && b->v_steps > 1) {
        b->v_steps /= 2; /* dead time has reduced the first pulses */
        return false;
    }
    burst_add(&s, b, io->loop->vbus_q15);
    measure_axes_add(&m->sums[d->phase], b->angle_q32, s.ud, s.uq);
    m->bursts++;
    if (m->bursts < IDENTIFY_AXES * BURSTS_ANGLE) {
        return false;
    }
    m->held_steps = d->phase == IDENTIFY_HELD ? b->v_steps : m->held_steps;
    b->v_steps = m->free_steps; /* large enough despite dead time */
    m->bursts = 0;
    d->axis_counts = d->counts;
    identify_enter(d, d->phase + 1u);
    return d->phase == IDENTIFY_PASSES;
}

/* Alternates d and q; two halves in sequence, so that motion of the rotor becomes visible. */
bool identify_measure_inductance(struct identify *d, const struct measure_io *io)
{
    struct identify_inductance *const m = &d->work.inductance;
    if (!settle(d, io->loop, !d->reluctant)) {
        return false;
    }
    const uint32_t axis = m->bursts % 2u, half = m->bursts / BURSTS_AXIS;
    identify_play(d, io, PULLED_Q32, d->axis_q32 + axis * QUARTER_Q32);
    burst_add(&m->sums[axis][half], &d->burst, io->loop->vbus_q15);
    m->bursts++;
    return m->bursts == 2u * BURSTS_AXIS;
}

/* ---- evaluation ---- */

bool identify_doubled(const struct measure_axes *m)
{
    const struct measure_shares s = measure_axes_shares(m);
    return 3 * identify_root((int64_t)s.re * s.re + (int64_t)s.im * s.im) > s.straight; /* (2 - 1) / (2 + 1) */
}

enum identify_reason identify_evaluate_axes(struct identify *d)
{
    const struct identify_axes *const m = &d->work.axes;
    const uint32_t held_q32 = measure_axes_angle_q32(&m->sums[IDENTIFY_HELD]);
    const uint32_t free_q32 = measure_axes_angle_q32(&m->sums[IDENTIFY_FREE]);
    d->reluctant = identify_doubled(&m->sums[IDENTIFY_FREE]);
    d->burst.v_steps = d->reluctant ? m->free_steps : m->held_steps;
    const uint32_t off_q32 = (held_q32 - PULLED_Q32 + QUARTER_Q32 / 2u) % (2u * QUARTER_Q32);
    const bool along = off_q32 < QUARTER_Q32;
    if (d->reluctant && d->results[IDENTIFY_RESISTANCE].state == IDENTIFY_KNOWN) {
        d->results[IDENTIFY_RESISTANCE].interval *= TURNED_TIMES;
        identify_refuse(d, IDENTIFY_DEAD_TIME, IDENTIFY_DEAD_TIME, IDENTIFY_TURNED);
    }
    d->axis_q32 = d->reluctant ? free_q32 : along ? held_q32 : held_q32 + QUARTER_Q32;
    return IDENTIFY_NO_REASON;
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
    const int64_t u_uv = identify_wave_uv(d, s);
    const int64_t i_na = identify_change_na(d, identify_scaled(above, 256, below));
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
    const int64_t mean = (halves[0] + halves[1]) / 2, apart = identify_size(halves[0] - halves[1]);
    const bool silent = halves[0] == 0 || halves[1] == 0;
    if (silent || apart * 10 > mean) {
        identify_refuse(d, what, what, silent ? IDENTIFY_NO_CURRENT : IDENTIFY_SCATTER);
        return;
    }
    /* a wave's amplitude is accurate to half a count on either side; slots make inductances vary with the angle */
    const int64_t height = identify_scaled(mean, 1 << CONFIG_V_SHIFT, 2 * d->burst.v_steps);
    const int64_t slots = identify_permille(mean, SLOTS_PERMILLE);
    const int64_t gains = identify_permille(mean, IDENTIFY_CURRENT_GAIN_PERMILLE + IDENTIFY_BUS_GAIN_PERMILLE);
    const int64_t others = identify_root(height * height + slots * slots + bound * bound);
    identify_set(d, what, mean, identify_interval(apart >> 1, gains, others));
}

/*
 * Result of a half: along[] without coupling, nH. With a cross response, uq / ud of that along, the inverse inductances are a
 * matrix [1 / l0, c; c, 1 / l1]. Times l0 l1: mean +- difference on its diagonal, cross off it.
 */
struct seen {
    int64_t along[2], difference, cross, size; /* size: of difference and cross together */
};

static struct seen look(const struct identify *d, uint32_t half)
{
    const struct burst_sums *const p = &d->work.inductance.sums[0][half], *const q = &d->work.inductance.sums[1][half];
    struct seen s = {.along = {identify_inductance_nh(d, p), identify_inductance_nh(d, q)}};
    if (s.along[0] != 0 && s.along[1] != 0) { /* so there is a response along */
        s.difference = (s.along[1] - s.along[0]) / 2;
        s.cross = (identify_scaled(s.along[1], p->uq, p->ud) - identify_scaled(s.along[0], q->uq, q->ud)) / 2;
        s.size = identify_root(s.difference * s.difference + s.cross * s.cross);
    }
    return s;
}

/* The axes of both halves differ: the sine of twice the angle between them is a fifth or more. */
static bool axes_moved(const struct seen *a, const struct seen *b)
{
    const int64_t along = identify_scaled(a->difference, b->cross, b->size),
                  across = identify_scaled(a->cross, b->difference, b->size);
    return identify_size(along - across) * 5 > a->size;
}

/* Inductances along the axes of a free rotor: the smaller one first. */
static void turn_to_axes(struct seen *s)
{
    const int64_t mean = (s->along[0] + s->along[1]) / 2, l0 = s->along[0], l1 = s->along[1];
    if (s->size != 0 && s->size < mean) {
        s->along[0] = identify_scaled(l0, l1, mean + s->size);
        s->along[1] = identify_scaled(l0, l1, mean - s->size);
    }
}

enum identify_reason identify_evaluate_inductance(struct identify *d)
{
    struct seen of[] = {look(d, 0), look(d, 1)};
    if (d->reluctant) {
        if (of[0].size != 0 && of[1].size != 0 && axes_moved(&of[0], &of[1])) {
            identify_refuse(d, IDENTIFY_LD, IDENTIFY_LQ, IDENTIFY_SCATTER);
            return IDENTIFY_NO_REASON;
        }
        turn_to_axes(&of[0]);
        turn_to_axes(&of[1]);
    }
    for (int32_t axis = 0; axis < 2; axis++) {
        const int64_t halves[] = {of[0].along[axis], of[1].along[axis]};
        const int64_t free_nh = d->reluctant ? identify_permille((halves[0] + halves[1]) / 2, FREE_PERMILLE) : 0;
        identify_know_inductance(d, axis == 0 ? IDENTIFY_LD : IDENTIFY_LQ, halves, free_nh);
    }
    return IDENTIFY_NO_REASON;
}

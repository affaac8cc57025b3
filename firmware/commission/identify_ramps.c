/* SPDX-License-Identifier: MIT */
/*
 * The rotor swings between two speeds, driven by one current in alternating directions. Passing the same speeds once gaining
 * and once slowing down, friction and load are the same but the torques differ: J = (T1 - T2) / (a1 - a2), whatever the
 * friction. The flux that makes the torque is that of this current, from the voltage over the speed of these very ramps.
 */
#include "firmware/commission/identify_parts.h"
#include "firmware/settings/scale.h"
#include "lib/q15.h"

#define PATIENCE_MS  5000u
#define SLOW_TENTHS  3 /* of the largest speed: between these two a run is taken */
#define FAST_TENTHS  9
#define FEW_RAMPS    4 /* of a reluctant machine, whose ramps are long */
#define PAIRS_MOST   (IDENTIFY_RAMPS - 1)
#define REST_MS      50u
#define LEAD_MS      300u
#define TENTH        10
#define FLUXES       4 /* both ways, gaining and slowing */
#define LEAST_E1_UWB 100

/* Of the flux, at rated current: machines of the bench lose 2 to 4 % at 1.5 times that. */
#define SATURATION_PERMILLE 50

static uint32_t ramps(const struct identify *d)
{
    return d->reluctant ? FEW_RAMPS : IDENTIFY_RAMPS;
}

/* ---- measuring ---- */

/* Speeds as this ramp sees them grow: from -most to most. */
static void run(struct identify *d, struct identify_ramps *m, const struct identify_io *io, int32_t sign)
{
    const int32_t most_q15 = d->rpm_most * 32768;
    const int32_t x_q15 = io->speed->estimate.speed_rpm_q15 * sign;
    const int32_t slow_q15 = most_q15 / 10 * SLOW_TENTHS, fast_q15 = most_q15 / 10 * FAST_TENTHS;
    identify_push(io, sign * d->ramp_i_q15);
    if (x_q15 > slow_q15 && x_q15 < fast_q15) {
        identify_run_add(&m->gains[m->ramp], io);
    } else if (x_q15 < -slow_q15 && x_q15 > -fast_q15) {
        identify_run_add(&m->slows[m->ramp], io);
    }
    if (x_q15 >= most_q15) {
        m->ramp++;
        m->phase_ms = 0;
    }
}

/*
 * Where only a small current lets the offset be known, a constant speed has one: the frame is put right there. True when
 * it is.
 */
static bool lead(struct identify *d, struct identify_ramps *m, const struct identify_io *io)
{
    if (!d->reluctant || m->led_ms >= LEAD_MS) {
        return true;
    }
    identify_control_speed(io, -d->rpm_most, identify_i_most_q15(d));
    m->led_ms = io->speed->ref_rpm_q16 == -d->rpm_most * 65536 ? m->led_ms + 1u : 0u;
    return false;
}

bool identify_measure_ramps(struct identify *d, const struct identify_io *io)
{
    struct identify_ramps *const m = &d->ramps;
    if (d->ms == 1u) {
        *m = (struct identify_ramps){0};
        speed_loop_reset(io->speed, 0);
    }
    m->phase_ms++;
    identify_correct_offset(d, io);
    if (!lead(d, m, io)) {
        return m->phase_ms > PATIENCE_MS;
    }
    if (m->ramp < ramps(d)) {
        run(d, m, io, m->ramp % 2u == 0u ? 1 : -1);
        if (m->ramp == ramps(d)) {
            speed_loop_reset(io->speed, 0);
        }
        return m->phase_ms > PATIENCE_MS;
    }
    identify_control_speed(io, 0, identify_i_most_q15(d));
    return (io->speed->ref_rpm_q16 == 0 && m->phase_ms > REST_MS) || m->phase_ms > PATIENCE_MS;
}

/* ---- evaluation ---- */

/* Of all ramps one way, slowing down or gaining speed. */
static int64_t flux_e1_uwb(const struct identify *d, int32_t way, const struct identify_run of[IDENTIFY_RAMPS])
{
    const struct identify_run *runs[IDENTIFY_RAMPS];
    int32_t count = 0;
    for (int32_t k = way; k < (int32_t)ramps(d); k += 2) {
        runs[count++] = &of[k];
    }
    return identify_flux_of_runs(d, runs, count);
}

static bool know_flux(struct identify *d)
{
    int64_t of[FLUXES];
    for (int32_t way = 0; way < 2; way++) {
        of[2 * way] = flux_e1_uwb(d, way, d->ramps.slows);
        of[2 * way + 1] = flux_e1_uwb(d, way, d->ramps.gains);
    }
    const struct identify_spread flux = identify_spread(of, FLUXES);
    if (flux.mean < LEAST_E1_UWB || flux.deviation * TENTH > flux.mean) {
        identify_refuse(d, IDENTIFY_FLUX, flux.mean < LEAST_E1_UWB ? IDENTIFY_TOO_SLOW : IDENTIFY_SCATTER);
        return false;
    }
    d->flux_e1_uwb = (int32_t)flux.mean;
    /* what saturation takes of it grows with the square of the current across */
    const int64_t squared = scale((int64_t)d->ramp_i_q15 * d->ramp_i_q15, SATURATION_PERMILLE * 1000LL,
                                  (int64_t)d->i_rated_q15 * d->i_rated_q15);
    identify_know(d, IDENTIFY_FLUX, flux.mean,
                  identify_interval(flux.deviation, scale(flux.mean, IDENTIFY_BUS_GAIN_PERMILLE, 1000),
                                    scale(flux.mean, squared, 1000000)));
    return true;
}

static void know_inertia(struct identify *d)
{
    int64_t of[PAIRS_MOST];
    const int32_t pairs = (int32_t)ramps(d) - 1;
    for (int32_t k = 0; k < pairs; k++) {
        of[k] = identify_inertia_gmm2(d, d->flux_e1_uwb, &d->ramps.gains[k], &d->ramps.slows[k + 1]);
    }
    const struct identify_spread inertia = identify_spread(of, pairs);
    if (inertia.mean < 1 || inertia.deviation * TENTH > inertia.mean) {
        identify_refuse(d, IDENTIFY_INERTIA, IDENTIFY_SCATTER);
        return;
    }
    const int64_t gain = scale(inertia.mean, IDENTIFY_CURRENT_GAIN_PERMILLE, 1000);
    const int64_t flux = scale(inertia.mean, d->results[IDENTIFY_FLUX].interval, d->flux_e1_uwb);
    identify_know(d, IDENTIFY_INERTIA, inertia.mean, identify_interval(inertia.deviation, gain, flux));
    d->params.inertia_gmm2 = (int32_t)inertia.mean;
}

bool identify_think_ramps(struct identify *d)
{
    if (d->ramps.ramp < ramps(d)) {
        identify_refuse_rest(d, IDENTIFY_OFFSET, IDENTIFY_LOADED);
        return false;
    }
    if (!know_flux(d)) {
        identify_refuse_rest(d, IDENTIFY_OFFSET, d->results[IDENTIFY_FLUX].reason);
        return false;
    }
    if (d->indexed) {
        know_inertia(d);
    }
    return true;
}

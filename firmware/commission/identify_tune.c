/* SPDX-License-Identifier: MIT */
/* The tuning by which identify measures: from what is known of the motor by then, which at first is nothing. */
#include "firmware/commission/identify_parts.h"

/* With these the speed loop's numbers fit their formats, whatever the inverter is; nothing runs by them. */
#define FLUX_HZ          400 /* at which the bus voltage would be induced */
#define INERTIA_PART     700 /* gmm2 by uWb times mA */
#define INERTIA_MOST     2100000000
#define INDUCTANCE_PARTS 63 /* tuning.h: w_base L below 64 v_range / i_range */
#define RELUCTANT_PARTS \
    15 /* the large one, known without current, falls several times with it: loops would be too fast */

/* While the rotor turns. */
#define TURNING_HZ       300
#define TURNING_SPEED_HZ 10

/* What the speed loop could do with it does not matter at standstill, and is little while the rotor turns. */
static bool compute(struct identify *d, int32_t hz, struct tuning *t)
{
    struct params *const p = &d->params;
    const int64_t parts = d->reluctant ? RELUCTANT_PARTS : INDUCTANCE_PARTS;
    const int64_t largest_uh = scale(p->v_range_mv, parts * 1000000LL, 7854LL * p->i_range_ma);
    p->current_bw_hz = hz;
    p->ld_uh = identify_within(p->ld_uh, largest_uh);
    p->lq_uh = identify_within(p->lq_uh, largest_uh);
    const struct outcome outcome = tuning_compute(p, t);
    return outcome.error == ERROR_NONE || outcome.error == ERROR_SPEED_RESOLUTION ||
           outcome.error == ERROR_SPEED_UNRESOLVED || outcome.error == ERROR_SPEED_MARGIN ||
           outcome.error == ERROR_CURRENT_TOO_SLOW || outcome.error == ERROR_ENCODER_COARSE;
}

enum identify_reason identify_tune(struct identify *d, int32_t hz)
{
    struct tuning t;
    if (!compute(d, hz, &t)) {
        return IDENTIFY_STOPPED;
    }
    t.kp_q_q12 = 0;   /* see calm() */
    t.ripple_q10 = 0; /* the steps set dead-time compensation themselves */
    d->tuning = t;
    return IDENTIFY_NO_REASON;
}

enum identify_reason identify_tune_turning(struct identify *d, enum identify_reason otherwise)
{
    struct tuning t;
    d->params.speed_bw_hz = TURNING_SPEED_HZ;
    if (!compute(d, TURNING_HZ, &t)) {
        return otherwise;
    }
    t.emf_q12 = d->flux_e1_uwb == 0 ? 0 : t.emf_q12; /* not known yet */
    d->tuning = t;
    d->retuned = true;
    return IDENTIFY_NO_REASON;
}

void identify_retake(struct identify *d)
{
    d->ripple_q10 = d->tuning.ripple_q10;
    d->retuned = true;
}

void identify_forget_motor(struct params *p)
{
    const int64_t trip_ma = p->i_trip_ma * 85LL / 100;
    p->pole_pairs = 1;
    p->encoder_counts = (int32_t)ENCODER_COUNTS_MAX; /* whatever it has: it is only followed */
    p->angle_source = PARAM_ANGLE_ENCODER;           /* a prescribed field; whether anything counts does not matter */
    p->resistance_mohm = identify_within(scale(p->v_range_mv, 20, p->i_range_ma), 100000);
    p->ld_uh = p->lq_uh = identify_within(scale(p->v_range_mv, 10, p->i_range_ma), 1000000);
    p->ld_apparent_uh = p->lq_apparent_uh = p->lq_rest_uh = p->cross_pm = 0;
    p->flux_uwb = (int32_t)scale(p->v_range_mv, 1000000, 6283LL * FLUX_HZ); /* 0.8 Wb at most */
    p->inertia_gmm2 = identify_within(scale(p->flux_uwb, p->i_range_ma, INERTIA_PART), INERTIA_MOST);
    p->i_max_ma = identify_within(p->i_rated_ma, trip_ma);
    p->i_align_ma = p->i_max_ma;
    p->pwm_update = PWM_UPDATE_VALLEY;
    p->pwm_samples = 1;
    p->speed_bw_hz = 1;
    p->position_bw_hz = 0;
    p->torque_mean_ms = 1;
}

/* SPDX-License-Identifier: MIT */
#include "firmware/commission/cogging_learn.h"

#include "firmware/settings/scale.h"
#include "lib/q15.h"
#include "lib/trig.h"

#define RUN_UP_SHARE 8         /* of a turn, until the speed is steady */
#define LEAST_SHARE  20        /* of the largest harmonic: anything smaller is noise */
#define JERKED_Q19   (1 << 29) /* no current accelerates so much: the encoder jumped */

static void add_candidate(struct cogging_learn *l, int32_t order)
{
    if (order <= COGGING_ORDER_MOST && l->candidates < COGGING_CANDIDATES) {
        l->orders[l->candidates++] = (uint16_t)order;
    }
}

void cogging_learn_begin(struct cogging_learn *l, const struct turns *turns, const struct tuning *t)
{
    *l = (struct cogging_learn){.phase = COGGING_FORWARD_BEGINS, .from = turns->counts};
    for (int32_t order = 1; order <= 2; order++) {
        if (order % t->pole_pairs != 0) {
            add_candidate(l, order);
        }
    }
    /* beyond a quarter of the counts the encoder cannot resolve it */
    const int32_t most = q15_min(COGGING_ORDER_MOST, t->encoder_counts / 4);
    for (int32_t order = t->pole_pairs; order <= most; order += t->pole_pairs) {
        add_candidate(l, order);
    }
}

int32_t cogging_learn_direction(const struct cogging_learn *l)
{
    const uint32_t phase = l->phase;
    const bool forward = phase == COGGING_FORWARD_BEGINS || phase == COGGING_FORWARD;
    const bool back = phase == COGGING_BACK_BEGINS || phase == COGGING_BACK;
    return forward ? 1 : back ? -1 : 0;
}

/* Turned in the last millisecond, not against the direction. */
static int32_t way_q7(const struct speed_estimate *e, int32_t direction)
{
    return q15_max((e->travel_q15 >> 8) * direction, 0);
}

/* Each sample is of the last step: what the mean of the torques before and after it made of the speed around it. */
static struct cogging_sample sample_of(const struct cogging_learn *l, const struct speed_estimate *e,
                                       int32_t torque_q15, int32_t direction, const struct tuning *t)
{
    const int64_t change_q16 = ((int64_t)e->speed_rpm_q15 - l->speed_rpm_q15) * 2;
    const int32_t accelerating_q19 = scale_clamp((t->speed_accel_q8 * change_q16) >> 20, -JERKED_Q19, JERKED_Q19);
    return (struct cogging_sample){
        .angle_q32 = l->angle_q32,
        .torque_q19 = (torque_q15 + l->torque_q15) * 8 - accelerating_q19,
        .way_q7 = (way_q7(e, direction) + l->way_q7) / 2,
    };
}

static void cogging_put(struct cogging_learn *l, struct cogging_sample s)
{
    if (l->put - l->taken >= COGGING_SAMPLES) {
        l->lost++;
        return;
    }
    l->samples[l->put % COGGING_SAMPLES] = s;
    l->put++;
}

static void cogging_next_phase(struct cogging_learn *l, int64_t counts)
{
    l->phase++;
    l->from = counts;
}

void cogging_learn_step(struct cogging_learn *l, const struct turns *turns, const struct speed_estimate *e,
                        int32_t torque_q15, const struct tuning *t)
{
    const int32_t direction = cogging_learn_direction(l);
    const int64_t way = (turns->counts - l->from) * direction;
    const bool records = l->phase == COGGING_FORWARD || l->phase == COGGING_BACK;
    if (records) {
        cogging_put(l, sample_of(l, e, torque_q15, direction, t));
    }
    if (direction != 0 && way >= (records ? t->encoder_counts : t->encoder_counts / RUN_UP_SHARE)) {
        cogging_next_phase(l, turns->counts);
    }
    l->torque_q15 = torque_q15;
    l->way_q7 = way_q7(e, direction);
    l->speed_rpm_q15 = e->speed_rpm_q15;
    l->angle_q32 = cogging_angle_q32(e, t);
}

static void correlate(struct cogging_learn *l, const struct cogging_sample *s)
{
    const int64_t weighed = (int64_t)s->torque_q19 * s->way_q7;
    for (int32_t n = 0; n < l->candidates; n++) {
        const cossin_t c = cossin_q15(l->orders[n] * s->angle_q32);
        l->cos_sum[n] += weighed * c.cos;
        l->sin_sum[n] += weighed * c.sin;
    }
    l->way_sum_q7 += s->way_q7;
    l->used++;
}

/* Amplitudes are twice the mean product: Q19 and 15 bits, as Q23. */
static struct cogging_harmonic harmonic(const struct cogging_learn *l, int32_t n)
{
    const int64_t way = l->way_sum_q7 > 0 ? l->way_sum_q7 : 1;
    return (struct cogging_harmonic){l->orders[n], (int32_t)(l->cos_sum[n] / way >> 10),
                                     (int32_t)(l->sin_sum[n] / way >> 10)};
}

static int64_t power(struct cogging_harmonic h)
{
    return (int64_t)h.cos_q23 * h.cos_q23 + (int64_t)h.sin_q23 * h.sin_q23;
}

/* Into its place among the largest so far. */
static void insert(struct cogging_map *m, struct cogging_harmonic h)
{
    int32_t place = m->count < COGGING_HARMONICS ? m->count++ : COGGING_HARMONICS - 1;
    if (place == COGGING_HARMONICS - 1 && power(m->harmonics[place]) >= power(h)) {
        return;
    }
    for (; place > 0 && power(m->harmonics[place - 1]) < power(h); place--) {
        m->harmonics[place] = m->harmonics[place - 1];
    }
    m->harmonics[place] = h;
}

static void choose(const struct cogging_learn *l, struct cogging_map *m)
{
    *m = (struct cogging_map){.count = 0};
    for (int32_t n = 0; n < l->candidates; n++) {
        insert(m, harmonic(l, n));
    }
    const int64_t least = power(m->harmonics[0]) / (LEAST_SHARE * LEAST_SHARE);
    while (m->count > 0 && power(m->harmonics[m->count - 1]) <= least) {
        m->count--;
    }
}

bool cogging_learn_review(struct cogging_learn *l, struct cogging_map *m)
{
    const bool last = l->phase == COGGING_REVIEW; /* read before taking the rest: no more samples come then */
    while (l->taken != l->put) {
        correlate(l, &l->samples[l->taken % COGGING_SAMPLES]);
        l->taken++;
    }
    if (last) {
        choose(l, m);
        l->phase = COGGING_DONE;
    }
    return last;
}

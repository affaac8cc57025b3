/* SPDX-License-Identifier: MIT */
#include "firmware/commission/learn.h"

#include "drivers/cortex/cpu.h"
#include "firmware/commission/measure.h"
#include "firmware/settings/scale.h"
#include "lib/q15.h"
#include "lib/trig.h"

/* ==== Hall switches ==== */

#define FIELD_HZ     2
#define TURN_MS      (1000u / FIELD_HZ)
#define GROWS_SHIFT  6     /* a 64th of the current a millisecond */
#define SPEED_UP_MS  1000u /* over a turn: slow enough to avoid oscillation */
#define RECORD_MS    (HALL_LEARN_TURNS * TURN_MS)
#define LOAD_MAX_Q32 0x20000000 /* 45 degrees between forward and back */
#define SPREAD_Q32   0x0E38E38E /* 20 degrees from turn to turn */
#define DEGREE_Q32   11930465

enum phase { FORWARD, BACK, ENDED };

void hall_learn_begin(struct hall_learn *l)
{
    *l = (struct hall_learn){.phase = FORWARD, .state = HALL_STATES};
}

int32_t hall_learn_states(const struct hall_learn *l)
{
    int32_t states = 0;
    for (uint32_t state = 0; state < HALL_STATES; state++) {
        states += l->forward[state].count != 0u;
    }
    return states;
}

/* ---- the field ---- */

/* From standstill to full speed forward, then to full speed backward in twice the time. */
static void move_field(const struct hall_learn *l, volatile struct current_loop *c, const struct tuning *t)
{
    const int32_t full_q32 = (int32_t)((1LL << 32) * FIELD_HZ / t->loop_hz); /* electrical turns a sample */
    const int32_t ms = (int32_t)l->ms, max_ms = (int32_t)SPEED_UP_MS;
    const int32_t part_ms = l->phase == FORWARD ? q15_min(ms, max_ms) : q15_max(max_ms - ms, -max_ms);
    const int32_t max_q15 = (t->field.i_align_q15 >> GROWS_SHIFT) + 1;
    current_loop_field_speed(c, (int32_t)((int64_t)full_q32 * part_ms / max_ms));
    current_loop_set_currents(c, measure_towards(c->i_d_ref_q15, t->field.i_align_q15, max_q15), 0);
}

static uint32_t record_from_ms(const struct hall_learn *l)
{
    return l->phase == FORWARD ? SPEED_UP_MS : 2u * SPEED_UP_MS;
}

static void hall_learn_next_phase(struct hall_learn *l)
{
    if (l->ms >= record_from_ms(l) + RECORD_MS) {
        l->phase++;
        l->ms = 0;
    }
}

/* ---- edges ---- */

/* The field's angle at the edge: that of the last sample, less the travel since the edge. */
static uint32_t field_at_edge(volatile struct current_loop *c, const struct encoder_regs *e, const struct tuning *t,
                              uint32_t *state)
{
    const uint32_t mask = cpu_irq_save();
    const uint32_t field_q32 = c->field_angle_q32 - (uint32_t)c->field_speed_q32;
    const uint32_t age_clocks = encoder_latch_clock(e) - encoder_hall_clock(e);
    *state = encoder_hall_latched(e);
    cpu_irq_restore(mask);
    return field_q32 - (uint32_t)((int64_t)c->field_speed_q32 * (int64_t)age_clocks / t->loop_counts);
}

static void record(struct hall_learn *l, struct hall_edge *edge, uint32_t from, uint32_t field_q32)
{
    if (edge->count == 0u) {
        edge->first_q32 = field_q32;
        edge->from = from;
    }
    const int32_t off_q32 = (int32_t)(field_q32 - edge->first_q32);
    l->unclear = l->unclear || edge->from != from || off_q32 > SPREAD_Q32 || off_q32 < -SPREAD_Q32;
    edge->sum_q8 += off_q32 >> 8;
    edge->count++;
    l->edges++;
}

static void hall_learn_look(struct hall_learn *l, volatile struct current_loop *c, const struct encoder_regs *e,
                            const struct tuning *t)
{
    uint32_t state;
    const uint32_t field_q32 = field_at_edge(c, e, t, &state);
    const uint32_t before = l->state;
    l->state = state;
    if (before == state || before == HALL_STATES || l->ms < record_from_ms(l)) {
        return;
    }
    if (l->phase == FORWARD) {
        record(l, &l->forward[state], before, field_q32);
    } else {
        record(l, &l->against[before], state, field_q32);
    }
}

/* ---- the table ---- */

/* Each edge once a turn, the same in both directions; the last turn may lack one. */
static bool complete(const struct hall_learn *l)
{
    for (uint32_t state = 0; state < HALL_STATES; state++) {
        const struct hall_edge *const f = &l->forward[state];
        const struct hall_edge *const b = &l->against[state];
        const bool seen = f->count != 0u || b->count != 0u;
        const bool often = f->count + 1u >= HALL_LEARN_TURNS && f->count <= HALL_LEARN_TURNS + 1u &&
                           b->count + 1u >= HALL_LEARN_TURNS && b->count <= HALL_LEARN_TURNS + 1u;
        if (seen && (!often || f->from != b->from)) {
            return false;
        }
    }
    return !l->unclear && hall_learn_states(l) == (int32_t)HALL_SECTORS;
}

static uint32_t mean_of(const struct hall_edge *edge)
{
    return edge->first_q32 + (uint32_t)(edge->sum_q8 / (int32_t)edge->count * 256);
}

/* The middle of forward and back; false if they are too far apart. */
static bool find_edge(struct hall_learn *l, uint32_t state, uint32_t *edge_q32)
{
    const uint32_t forward_q32 = mean_of(&l->forward[state]);
    const int32_t apart_q32 = (int32_t)(mean_of(&l->against[state]) - forward_q32);
    *edge_q32 = forward_q32 + (uint32_t)(apart_q32 / 2);
    l->detail_deg = apart_q32 / DEGREE_Q32;
    return apart_q32 < LOAD_MAX_Q32 && apart_q32 > -LOAD_MAX_Q32;
}

/* The state that begins next after `angle_q32`. */
static uint32_t next_after(const uint32_t edge_q32[HALL_STATES], const struct hall_learn *l, uint32_t angle_q32)
{
    uint32_t nearest = 0;
    uint32_t way_q32 = UINT32_MAX;
    for (uint32_t state = 0; state < HALL_STATES; state++) {
        if (l->forward[state].count != 0u && edge_q32[state] - angle_q32 <= way_q32) {
            way_q32 = edge_q32[state] - angle_q32;
            nearest = state;
        }
    }
    return nearest;
}

/* From angle 0; each state begins where the previous one ends. */
static bool make_ring(struct hall_learn *l, const uint32_t edge_q32[HALL_STATES])
{
    uint32_t angle_q32 = 0;
    for (uint32_t place = 0; place < HALL_SECTORS; place++) {
        const uint32_t state = next_after(edge_q32, l, angle_q32);
        l->found.state[place] = state;
        l->found.edge_q32[place] = edge_q32[state];
        angle_q32 = edge_q32[state] + 1u;
    }
    for (uint32_t place = 0; place < HALL_SECTORS; place++) {
        const uint32_t next = l->found.state[(place + 1u) % HALL_SECTORS];
        if (l->forward[next].from != l->found.state[place]) {
            return false;
        }
    }
    return true;
}

static enum hall_learn_result hall_learn_judge(struct hall_learn *l)
{
    uint32_t edge_q32[HALL_STATES] = {0};
    if (l->edges < HALL_LEARN_TURNS) {
        return HALL_LEARN_BLOCKED;
    }
    if (!complete(l)) {
        return HALL_LEARN_UNCLEAR;
    }
    for (uint32_t state = 0; state < HALL_STATES; state++) {
        if (l->forward[state].count != 0u && !find_edge(l, state, &edge_q32[state])) {
            return HALL_LEARN_LOAD;
        }
    }
    return make_ring(l, edge_q32) ? HALL_LEARN_DONE : HALL_LEARN_UNCLEAR;
}

enum hall_learn_result hall_learn_step(struct hall_learn *l, volatile struct current_loop *c,
                                       const struct encoder_regs *e, const struct tuning *t)
{
    l->ms++;
    hall_learn_look(l, c, e, t);
    hall_learn_next_phase(l);
    if (l->phase == ENDED) {
        current_loop_field_speed(c, 0);
        return hall_learn_judge(l);
    }
    move_field(l, c, t);
    return HALL_LEARN_RUNNING;
}

/* ==== cogging ==== */

#define RUN_UP_SHARE 8         /* of a turn, until the speed is steady */
#define MIN_SHARE    20        /* of the largest harmonic: anything smaller is noise */
#define JUMP_Q19     (1 << 29) /* beyond any possible acceleration: the encoder jumped */

static void add_candidate(struct cogging_learn *l, int32_t order)
{
    if (order <= COGGING_ORDER_MAX && l->candidates < COGGING_CANDIDATES) {
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
    const int32_t most = q15_min(COGGING_ORDER_MAX, t->encoder_counts / 4);
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

/* Travel in the last millisecond, in the direction only. */
static int32_t travel_q7(const struct speed_estimate *e, int32_t direction)
{
    return q15_max((e->travel_q15 >> 8) * direction, 0);
}

/* A sample of the last step: mean of the torques before and after it, and the speed around it. */
static struct cogging_sample sample_of(const struct cogging_learn *l, const struct speed_estimate *e,
                                       int32_t torque_q15, int32_t direction, const struct tuning *t)
{
    const int64_t change_q16 = ((int64_t)e->speed_rpm_q15 - l->speed_rpm_q15) * 2;
    const int32_t accelerating_q19 = scale_clamp((t->speed_accel_q8 * change_q16) >> 20, -JUMP_Q19, JUMP_Q19);
    return (struct cogging_sample){
        .angle_q32 = l->angle_q32,
        .torque_q19 = (torque_q15 + l->torque_q15) * 8 - accelerating_q19,
        .travel_q7 = (travel_q7(e, direction) + l->travel_q7) / 2,
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
    const int64_t travel = (turns->counts - l->from) * direction;
    const bool records = l->phase == COGGING_FORWARD || l->phase == COGGING_BACK;
    if (records) {
        cogging_put(l, sample_of(l, e, torque_q15, direction, t));
    }
    if (direction != 0 && travel >= (records ? t->encoder_counts : t->encoder_counts / RUN_UP_SHARE)) {
        cogging_next_phase(l, turns->counts);
    }
    l->torque_q15 = torque_q15;
    l->travel_q7 = travel_q7(e, direction);
    l->speed_rpm_q15 = e->speed_rpm_q15;
    l->angle_q32 = cogging_angle_q32(e, t);
}

static void correlate(struct cogging_learn *l, const struct cogging_sample *s)
{
    const int64_t weighed = (int64_t)s->torque_q19 * s->travel_q7;
    for (int32_t n = 0; n < l->candidates; n++) {
        const cossin_t c = cossin_q15(l->orders[n] * s->angle_q32);
        l->cos_sum[n] += weighed * c.cos;
        l->sin_sum[n] += weighed * c.sin;
    }
    l->travel_sum_q7 += s->travel_q7;
    l->used++;
}

/* Amplitudes are twice the mean product: Q19 and 15 bits, as Q23. */
static struct cogging_harmonic harmonic(const struct cogging_learn *l, int32_t n)
{
    const int64_t travel = l->travel_sum_q7 > 0 ? l->travel_sum_q7 : 1;
    return (struct cogging_harmonic){l->orders[n], (int32_t)(l->cos_sum[n] / travel >> 10),
                                     (int32_t)(l->sin_sum[n] / travel >> 10)};
}

static int64_t power(struct cogging_harmonic h)
{
    return (int64_t)h.cos_q23 * h.cos_q23 + (int64_t)h.sin_q23 * h.sin_q23;
}

/* Inserts it in order of size. */
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
    const int64_t least = power(m->harmonics[0]) / (MIN_SHARE * MIN_SHARE);
    while (m->count > 0 && power(m->harmonics[m->count - 1]) <= least) {
        m->count--;
    }
}

bool cogging_learn_review(struct cogging_learn *l, struct cogging_map *m)
{
    const bool last = l->phase == COGGING_REVIEW; /* read before the rest is taken: then no more samples follow */
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

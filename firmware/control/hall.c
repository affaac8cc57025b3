/* SPDX-License-Identifier: MIT */
#include "firmware/control/hall.h"

#include "drivers/cortex/cpu.h"
#include "firmware/control/speed_estimate.h"
#include "firmware/settings/scale.h"
#include "lib/q15.h"

#define NO_PLACE HALL_SECTORS

static uint32_t next_place(uint32_t place)
{
    return (place + 1u) % HALL_SECTORS;
}

static void fill_sectors(struct hall *h, const struct hall_table *t)
{
    for (uint32_t state = 0; state < HALL_STATES; state++) {
        h->sector[state] = (struct hall_sector){.place = NO_PLACE};
    }
    for (uint32_t place = 0; place < HALL_SECTORS; place++) {
        const uint32_t half_q32 = (t->edge_q32[next_place(place)] - t->edge_q32[place]) / 2u;
        h->edge_q32[place] = t->edge_q32[place];
        h->sector[t->state[place]] = (struct hall_sector){
            .middle_q32 = t->edge_q32[place] + half_q32, .half_q32 = (int32_t)half_q32, .place = place};
    }
}

/* From a state in the table, or from none: then any state in the table counts as the same. */
static struct hall_move move_of(const struct hall *h, uint32_t from, uint32_t to)
{
    const uint32_t here = h->sector[from].place;
    const uint32_t there = h->sector[to].place;
    if (there == NO_PLACE) {
        return (struct hall_move){.next = (uint8_t)from, .invalid = 1};
    }
    struct hall_move move = {.next = (uint8_t)to};
    if (here != NO_PLACE && here != there) {
        move.step = next_place(here) == there ? 1 : (next_place(there) == here ? -1 : 0);
        move.skipped = move.step == 0;
    }
    return move;
}

/* Inverts current per slope, from rpm a millisecond to turns a sample: tuning.h. */
static int32_t push_q8(const struct tuning *t)
{
    return scale_clamp((int64_t)t->field.speed_per_rpm_q12 * (1 << 20) / q15_max(t->speed_accel_q8, 1), 0, INT32_MAX);
}

void hall_take_table(struct hall *h, const struct hall_table *table, const struct tuning *t)
{
    fill_sectors(h, table);
    for (uint32_t from = 0; from < HALL_STATES; from++) {
        for (uint32_t to = 0; to < HALL_STATES; to++) {
            h->move[from][to] = move_of(h, from, to);
        }
    }
    h->clock_share_q28 = (1u << 28) / (uint32_t)t->loop_counts;
    h->push_q8 = push_q8(t);
    h->push_most_q32 = scale_clamp(((int64_t)h->push_q8 * t->i_max_q15) >> 8, 0, INT32_MAX);
}

void hall_begin(struct hall *h, volatile struct current_loop *c, const struct encoder_regs *e)
{
    const uint32_t mask = cpu_irq_save();
    const uint32_t clock = encoder_hall_clock(e);
    h->state = encoder_hall_latched(e);
    h->count = 0;
    h->clock[0] = clock;
    h->speed = (struct hall_speed){.clock = clock,
                                   .clocks = SPEED_ESTIMATE_CLOCKS_LOST,
                                   .lost = true,
                                   .angle_q32 = h->sector[h->state].middle_q32};
    current_loop_place(c, h->speed.angle_q32, 0);
    cpu_irq_restore(mask);
}

/* ==== speed ==== */

#define MEAN_CLOCKS    (20u * (BOARD_FABRIC_HZ / 1000u))  /* longest mean over more edges */
#define LOST_CLOCKS    (250u * (BOARD_FABRIC_HZ / 1000u)) /* without an edge: at rest, long before the clock wraps */
#define SWUNG_CLOCKS   (50u * (BOARD_FABRIC_HZ / 1000u))  /* the same, once it has come back */
#define SPEED_MOST     (1 << 29)                          /* an eighth of a turn a sample: beyond any drive */
#define PUSH_MOST_Q8   (1 << 30)
#define SLOW_CLOCKS    (int64_t)(BOARD_FABRIC_HZ / 1000u)
#define FIRST_SHIFT    1
#define FIRST_CLOCKS   (5u * (BOARD_FABRIC_HZ / 1000u))
#define LOAD_SHIFT     2
#define HALF_TURN      3u /* edges: each switch has changed once */
#define WHOLE_TURN     6u
#define MISPLACED_PART 12 /* of a sector: 5 degrees */
#define MIDDLE_SHIFT   5  /* of the distance to the middle, per millisecond */

/* A consistent snapshot of the interrupt's results. */
struct reading {
    uint32_t count, state, angle_q32;
    uint32_t latch_clock;
    uint32_t clock[HALL_EDGES_STORED];
};

static void read(struct reading *r, const struct hall *h, const volatile struct current_loop *c,
                 const struct encoder_regs *e)
{
    const volatile struct hall *const now = h;
    const uint32_t mask = cpu_irq_save();
    r->count = now->count;
    r->state = now->state;
    r->angle_q32 = c->pll.angle_q32;
    r->latch_clock = encoder_latch_clock(e);
    for (uint32_t n = 0; n < HALL_EDGES_STORED; n++) {
        r->clock[n] = now->clock[n];
    }
    cpu_irq_restore(mask);
}

static uint32_t clock_of(const struct reading *r, uint32_t count)
{
    return r->clock[count % HALL_EDGES_STORED];
}

static int32_t clamp_both_ways(int64_t speed_q32, int32_t most_q32)
{
    return scale_clamp(speed_q32, -most_q32, most_q32);
}

/* Travel over clocks, as a speed; travel is less than 2^38, longer times lose eight bits. */
static int64_t mean_speed(int64_t travel_q32, uint32_t clocks, const struct tuning *t)
{
    return travel_q32 * t->loop_counts / (int64_t)(clocks < 1u ? 1u : clocks);
}

/* ---- the torque's part ---- */

/* What the torque alone would have done since the rotor rests: it turns one way, or begins anew. */
static void integrate_alone(struct hall_speed *s, const struct tuning *t, int32_t torque_q8)
{
    const bool goes_on = s->lost && (int64_t)s->alone_q32 * torque_q8 >= 0;
    s->alone_q32 = goes_on ? clamp_both_ways((int64_t)s->alone_q32 + (torque_q8 >> 8), SPEED_MOST) : 0;
    s->alone_angle_q32 = goes_on ? s->alone_angle_q32 + (int64_t)s->alone_q32 * t->loops_per_slow : 0;
}

/*
 * The speed's change in this millisecond. A load that has been seen to brake is not taken to turn the rotor round: that takes a
 * torque, or an edge that shows it. Friction ends at rest, and so does most of what hands do.
 */
static int32_t change_q8(const struct hall_speed *s, int32_t torque_q8)
{
    const int32_t torque_forward_q8 = torque_q8 * s->direction;
    const int32_t forward_q8 = (torque_q8 + s->load_q8) * s->direction;
    const bool turns_round =
        (int64_t)s->speed_q32 * s->direction <= 0 && forward_q8 < torque_forward_q8 && forward_q8 < 0;
    return turns_round ? (torque_forward_q8 < 0 ? torque_q8 : 0) : torque_q8 + s->load_q8;
}

/* At rest the load equals the torque. */
static void integrate_push(struct hall *h, const struct tuning *t, int32_t torque_q15)
{
    struct hall_speed *const s = &h->speed;
    const int32_t torque_q8 = clamp_both_ways((int64_t)torque_q15 * h->push_q8, PUSH_MOST_Q8);
    integrate_alone(s, t, torque_q8);
    s->load_q8 = s->lost ? -torque_q8 : s->load_q8;
    s->pushed_q32 += (uint64_t)(int64_t)(change_q8(s, torque_q8) >> 8);
    s->pushed_angle_q32 += s->pushed_q32 * (uint32_t)t->loops_per_slow;
}

/*
 * The first edge after rest: the rotor has turned by three quarters of a sector at most, as far as is known. If the torque
 * alone would have turned it further, the load has taken its share of speed and acceleration. Without this two sectors would
 * pass with a speed of 0.
 */
static void leave_rest(struct hall_speed *s, int32_t most_q32, int32_t direction)
{
    const int64_t way_q32 = s->alone_angle_q32 * direction;
    if (way_q32 <= 0) {
        return; /* a load drives it */
    }
    const int64_t share_q15 = way_q32 > most_q32 ? ((int64_t)most_q32 << 15) / way_q32 : 1 << 15;
    s->rest_q32 += (uint64_t)((s->alone_q32 * share_q15) >> 15);
    s->load_q8 -= (int32_t)((s->load_q8 * share_q15) >> 15);
}

void hall_resume(struct hall *h, const volatile struct current_loop *c, const struct encoder_regs *e,
                 int32_t torque_q15)
{
    const uint32_t clock = encoder_hall_clock(e);
    const int32_t speed_q32 = c->pll.speed_q32;
    h->state = encoder_hall_latched(e);
    h->count = 0;
    h->clock[0] = clock;
    h->speed = (struct hall_speed){.clock = clock,
                                   .direction = speed_q32 < 0 ? -1 : 1,
                                   .preset = true,
                                   .preset_clock = encoder_latch_clock(e),
                                   .speed_q32 = speed_q32,
                                   .rest_q32 = (uint64_t)(int64_t)speed_q32,
                                   .load_q8 = -clamp_both_ways((int64_t)torque_q15 * h->push_q8, PUSH_MOST_Q8),
                                   .angle_q32 = c->pll.angle_q32};
}

/* Its value at each edge since the last step, `moved` sectors: backwards from now. */
static void mark_edges(struct hall_speed *s, const struct reading *r, int32_t moved, const struct tuning *t)
{
    const uint32_t edges = moved == 0 ? 1u : (uint32_t)q15_abs(moved);
    uint32_t count = r->count;
    for (uint32_t n = 0; n < edges && n < HALL_EDGES_STORED; n++) {
        const int64_t age_clocks = (int64_t)(r->latch_clock - clock_of(r, count));
        s->pushed_angle_at_q32[count % HALL_EDGES_STORED] =
            s->pushed_angle_q32 - (uint64_t)((int64_t)s->pushed_q32 * age_clocks / t->loop_counts);
        count += moved < 0 ? 1u : UINT32_MAX;
    }
}

/* Attributes an unexpected speed change per millisecond to the load, which is four times the largest torque at most. */
static void attribute_to_load(struct hall *h, int64_t change_q32)
{
    const int32_t most_q8 = scale_clamp((int64_t)h->push_most_q32 * (4 * 256), 1, PUSH_MOST_Q8);
    h->speed.load_q8 = clamp_both_ways(h->speed.load_q8 + change_q32 * 256, most_q8);
}

/* ---- edges ---- */

/* The travel from the nth edge before the last one to the last. */
static int64_t sector_travel(const struct hall *h, uint32_t state, int32_t direction, uint32_t n)
{
    const uint32_t place = h->sector[state].place;
    if (n == WHOLE_TURN) {
        return direction * (1LL << 32);
    }
    if (direction > 0) {
        return h->edge_q32[place] - h->edge_q32[(place + HALL_SECTORS - n) % HALL_SECTORS];
    }
    return -(int64_t)(h->edge_q32[(place + 1u + n) % HALL_SECTORS] - h->edge_q32[(place + 1u) % HALL_SECTORS]);
}

/* Whether the nth edge before the last is recent enough to use. */
static bool near_enough(const struct hall_speed *s, const struct reading *r, uint32_t n)
{
    return s->intervals >= n && s->clock - clock_of(r, s->count - (uint32_t)s->direction * n) <= MEAN_CLOCKS;
}

/*
 * The last edges show an unexpected speed. In a first interval, nothing was expected: a long one means that a load moved the
 * rotor from rest, a short one that it was turning at switch-on.
 */
static void learn_load(struct hall *h, int64_t clocks, int64_t unexpected_q32)
{
    const bool first = h->speed.intervals == 1u;
    if (first && clocks < FIRST_CLOCKS) {
        return;
    }
    const int64_t within = clocks < SLOW_CLOCKS ? SLOW_CLOCKS : clocks;
    attribute_to_load(h, unexpected_q32 * SLOW_CLOCKS / within >> (first ? FIRST_SHIFT : LOAD_SHIFT));
}

/*
 * A quarter of the speed, plus four times the largest torque's effect in that time: more than any load does. Beyond it, the
 * edge is a wiring fault, not an over-speed.
 */
static int64_t likely_change(const struct hall *h, uint32_t clocks, int64_t change_q32)
{
    const struct hall_speed *const s = &h->speed;
    if (s->intervals == 1u) {
        return change_q32; /* nothing was expected */
    }
    const int64_t most_q32 = q15_abs(s->speed_q32) / 4 + (int64_t)h->push_most_q32 * 4 * clocks / SLOW_CLOCKS;
    return change_q32 > most_q32 ? most_q32 : (change_q32 < -most_q32 ? -most_q32 : change_q32);
}

/*
 * What of a change is believed: a single sector may be wrong by a switch that is out of place, a load may change the speed by
 * half of what the largest torque does. Of a heavy shaft that is little, and its speed follows the edges slowly. The load is
 * learned with the square of that share: a mean of speed and load would swing otherwise.
 */
static int64_t believed(const struct hall *h, uint32_t n, uint32_t clocks, int64_t change_q32)
{
    const int64_t load_q32 = (int64_t)h->push_most_q32 * clocks / (2 * SLOW_CLOCKS) + 1;
    const int64_t misplaced_q32 = n == 1u ? q15_abs(h->speed.speed_q32) / MISPLACED_PART : 0;
    return (change_q32 * ((load_q32 << 15) / (load_q32 + misplaced_q32))) >> 15;
}

/* Until the first full turn of edges, if that comes soon. */
static bool preset_is_better(struct hall_speed *s, const struct reading *r)
{
    s->preset = s->preset && s->intervals < WHOLE_TURN && r->latch_clock - s->preset_clock < MEAN_CLOCKS;
    return s->preset;
}

static void measure_speed(struct hall *h, const struct reading *r, const struct tuning *t)
{
    struct hall_speed *const s = &h->speed;
    if (s->intervals == 0u || preset_is_better(s, r)) {
        return; /* it came from the other side, or from rest */
    }
    const uint32_t n = near_enough(s, r, WHOLE_TURN) ? WHOLE_TURN : (near_enough(s, r, HALF_TURN) ? HALF_TURN : 1u);
    const uint32_t before = s->count - (uint32_t)s->direction * n;
    const int64_t pushed = (int64_t)(s->pushed_angle_at_q32[s->count % HALL_EDGES_STORED] -
                                     s->pushed_angle_at_q32[before % HALL_EDGES_STORED]);
    const uint32_t clocks = s->clock - clock_of(r, before);
    s->clocks = n == 1u ? 2u * clocks : clocks; /* one sector shows each misplaced switch */
    s->by_turn = n == WHOLE_TURN;
    const int64_t rest_q32 = mean_speed(sector_travel(h, r->state, s->direction, n) - pushed, clocks, t);
    const int64_t change_q32 = believed(h, n, clocks, likely_change(h, clocks, rest_q32 - (int64_t)s->rest_q32));
    learn_load(h, clocks, believed(h, n, clocks, change_q32));
    s->rest_q32 += (uint64_t)change_q32;
}

/* False if none came. An edge crossed back and forth within this millisecond has a new time. */
static bool take_edges(struct hall *h, const struct reading *r, const struct tuning *t)
{
    struct hall_speed *const s = &h->speed;
    const int32_t moved = (int32_t)(r->count - s->count);
    const bool there_and_back = clock_of(r, s->count) != s->clock;
    if (moved == 0 && !there_and_back) {
        return false;
    }
    mark_edges(s, r, moved, t);
    const int32_t direction = moved > 0 ? 1 : (moved < 0 ? -1 : 0);
    const uint32_t edges = (uint32_t)q15_abs(moved);
    const bool continues = !s->lost && direction != 0 && direction == s->direction && !there_and_back;
    const uint32_t intervals = continues ? s->intervals + edges : (edges == 0u ? 0u : edges - 1u);
    s->intervals = intervals > WHOLE_TURN ? WHOLE_TURN : intervals;
    s->direction = direction;
    s->sector_clocks = s->lost ? 0u : clock_of(r, r->count) - s->clock;
    s->count = r->count;
    s->clock = clock_of(r, r->count);
    if (s->lost) {
        leave_rest(s, h->sector[r->state].half_q32 / 2 * 3, direction);
    }
    s->lost = false;
    return true;
}

/*
 * Nothing for long. After an edge forth and back, as when the start has found the rotor, that is soon: its speed is unknown,
 * and a torque that begins in that state would be taken for one that a load resists.
 */
static bool has_come_to_rest(const struct hall_speed *s)
{
    const bool swung = s->intervals == 0u && s->sector_clocks != 0u;
    return s->age_clocks > LOST_CLOCKS ||
           (swung && s->age_clocks > SWUNG_CLOCKS && s->age_clocks - SWUNG_CLOCKS > s->sector_clocks);
}

/* Since the last edge it has turned by less than its sector; up to a quarter more is not attributed to the load. */
static void bound(struct hall *h, const struct reading *r, const struct tuning *t)
{
    struct hall_speed *const s = &h->speed;
    const uint32_t age_clocks = r->latch_clock - s->clock;
    const int64_t most_q32 = mean_speed((int64_t)h->sector[r->state].half_q32 * 5 / 2, age_clocks, t);
    s->age_clocks = age_clocks;
    s->lost = s->lost || has_come_to_rest(s);
    const int64_t speed_q32 = (int64_t)(s->rest_q32 + s->pushed_q32);
    s->speed_q32 = s->lost ? 0 : clamp_both_ways(speed_q32, clamp_both_ways(most_q32, SPEED_MOST));
    attribute_to_load(h, (s->speed_q32 - speed_q32) / 4);
    s->rest_q32 = (uint64_t)(int64_t)s->speed_q32 - s->pushed_q32;
    s->clocks = age_clocks > s->clocks ? age_clocks : s->clocks;
}

/* At rest, or at an unknown speed, any place in the sector is equally likely. */
static void go_to_middle(const struct hall *h, volatile struct current_loop *c)
{
    const uint32_t mask = cpu_irq_save();
    const int32_t off_q32 = (int32_t)(c->pll.angle_q32 - h->sector[h->state].middle_q32);
    current_loop_correct(c, 0u - (uint32_t)(off_q32 >> MIDDLE_SHIFT), 0);
    cpu_irq_restore(mask);
}

/*
 * No interval has told the speed, and nothing else says that it will leave the first half of its sector soon. Or it is so slow
 * that it counts as at rest before it leaves it: then it may as well have turned round.
 */
static bool speed_is_unknown(const struct hall *h, const struct tuning *t)
{
    const int64_t speed_q32 = q15_abs(h->speed.speed_q32);
    const int32_t half_q32 = h->sector[h->state].half_q32;
    return (h->speed.intervals == 0u && speed_q32 * t->loops_per_slow * (1 << MIDDLE_SHIFT) < half_q32) ||
           speed_q32 * (LOST_CLOCKS / SLOW_CLOCKS) * t->loops_per_slow < 2LL * half_q32;
}

/*
 * At most half a turn from the angle the speed predicts. While the speed is a mean over a turn the way is that speed's: angles
 * step at each switch that is out of place, and the speed loop's memory answered each step with torque.
 */
static void follow_angle(struct hall_speed *s, uint32_t angle_q32, const struct tuning *t)
{
    const uint32_t expected_q32 = (uint32_t)s->speed_q32 * (uint32_t)t->loops_per_slow;
    const int32_t beyond_q32 = (int32_t)(angle_q32 - s->angle_q32 - expected_q32);
    const bool by_turn = s->by_turn && s->intervals == WHOLE_TURN && s->age_clocks < MEAN_CLOCKS;
    s->travel_q32 = s->speed_q32 + (by_turn ? 0 : beyond_q32 / t->loops_per_slow);
    s->angle_q32 = angle_q32;
}

void hall_speed_step(struct hall *h, volatile struct current_loop *c, const struct encoder_regs *e,
                     const struct tuning *t, int32_t torque_q15)
{
    struct hall_speed *const s = &h->speed;
    struct reading r;
    read(&r, h, c, e);
    integrate_push(h, t, torque_q15);
    if (take_edges(h, &r, t)) {
        measure_speed(h, &r, t);
    }
    bound(h, &r, t);
    if (s->lost || speed_is_unknown(h, t)) {
        go_to_middle(h, c);
    }
    current_loop_run(c, s->speed_q32);
    follow_angle(s, r.angle_q32, t);
}

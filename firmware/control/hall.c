/* SPDX-License-Identifier: MIT */
#include "firmware/control/hall.h"

#include "drivers/cortex/cpu.h"
#include "firmware/control/speed_estimate.h"
#include "firmware/settings/scale.h"

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
    c->pll.angle_q32 = h->speed.angle_q32;
    c->pll.speed_q32 = 0;
    cpu_irq_restore(mask);
}

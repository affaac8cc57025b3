/* SPDX-License-Identifier: GPL-2.0-or-later */
/* For tests in Python: what the plant's headers have inline, and loops that would be too long there. */
#include <math.h>

#include "bit_streams.h"
#include "legs.h"
#include "plant.h"

/* An inverter and a motor without a fabric. */
struct bench_bridge {
    struct inverter inv;
    struct motor m;
    sim_ps now;
};

struct bench_rows {
    unsigned count;
    struct plant_row row[1024]; /* the last of them */
};

void bench_keep(void *rows, const struct plant_row *row);
void bench_run_motor(struct motor *m, const struct motor_source *source, double duration_s);
void bench_bridge_advance(struct bench_bridge *b, double duration_s);
double bench_low_side_a(const struct inverter *inv, int k, double i_leg_a);
int bench_level(const struct inverter *inv, int k);
void bench_bits(struct bit_streams *s, double from_ps, unsigned count, uint8_t *bits);

void bench_keep(void *rows, const struct plant_row *row)
{
    struct bench_rows *kept = rows;
    kept->row[kept->count++ % 1024] = *row;
}

void bench_run_motor(struct motor *m, const struct motor_source *source, double duration_s)
{
    double left_s = duration_s;
    while (left_s > 1e-12) {
        double dt_s = fmin(left_s, fmin(10e-6, motor_max_step_s(m, 0)));
        motor_step(m, source, dt_s);
        left_s -= dt_s;
    }
}

/* Lets the switches follow after their delays. */
void bench_bridge_advance(struct bench_bridge *b, double duration_s)
{
    sim_ps end = b->now + sim_from_s(duration_s);
    while (b->now < end) {
        sim_ps next = inverter_next_switch(&b->inv), to = next < end ? next : end;
        b->now = to > b->now ? inverter_advance(&b->inv, &b->m, b->now, to) : to;
        inverter_switch(&b->inv, b->now);
    }
}

double bench_low_side_a(const struct inverter *inv, int k, double i_leg_a)
{
    return leg_low_side_a(inv, k, i_leg_a);
}

int bench_level(const struct inverter *inv, int k)
{
    return leg_level(inv, k);
}

/* Of modulators clocked at 20 MHz. */
void bench_bits(struct bit_streams *s, double from_ps, unsigned count, uint8_t *bits)
{
    for (unsigned n = 0; n < count; n++) {
        bits[n] = (uint8_t)bit_streams_clock(s, from_ps + n * 50e3);
    }
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* CorePWM, which the twin computes from event to event, against a core that counts clock by clock: written from the
 * register description alone, with none of the twin's shortcuts. Small periods and edges, so that equal edges, edges at
 * 0, at PERIOD and beyond it, and writes just before and after the end of a period come up all the time. */
#include "corepwm.h"

#include <string.h>

#include "check.h"

#define RUNS           200
#define CLOCKS_PER_RUN 3000

struct registers {
    uint32_t prescale, period, enable, pos_edge[7], neg_edge[7];
};

struct reference {
    struct registers written, active;
    bool sync_update;
    uint32_t prescale_count, count;
    unsigned outputs;
};

static void reference_compare(struct reference *r)
{
    for (int n = 0; n < 7; n++) {
        unsigned mask = 1u << n;
        bool at_pos = r->count == r->active.pos_edge[n], at_neg = r->count == r->active.neg_edge[n];
        if (!(r->active.enable & mask)) {
            r->outputs &= ~mask;
        } else if (at_pos && at_neg) {
            r->outputs ^= mask;
        } else if (at_pos) {
            r->outputs |= mask;
        } else if (at_neg) {
            r->outputs &= ~mask;
        }
    }
}

static void reference_reset(struct reference *r)
{
    memset(r, 0, sizeof *r);
    r->written.prescale = r->written.period = 8;
    r->active = r->written;
    reference_compare(r);
}

static void reference_end_of_period(struct reference *r)
{
    r->count = 0;
    r->active.prescale = r->written.prescale;
    r->active.period = r->written.period;
    r->active.enable = r->written.enable;
    if (r->sync_update) {
        memcpy(r->active.pos_edge, r->written.pos_edge, sizeof r->active.pos_edge);
        memcpy(r->active.neg_edge, r->written.neg_edge, sizeof r->active.neg_edge);
    }
}

static void reference_clock(struct reference *r)
{
    if (r->prescale_count < r->active.prescale) {
        r->prescale_count++;
        return;
    }
    r->prescale_count = 0;
    if (r->count < r->active.period) {
        r->count++;
    } else {
        reference_end_of_period(r);
    }
    reference_compare(r);
}

/* One register of both gets the same small random value. */
static void write_both(struct corepwm *c, struct reference *r)
{
    uint32_t offset, value;
    unsigned n = any_u32() % 7;
    switch (any_u32() % 8) {
    case 0:
        offset = 0x00;
        r->written.prescale = value = any_u32() % 3;
        break;
    case 1:
        offset = 0x04;
        r->written.period = value = any_u32() % 25; /* 0: every count is the end of a period */
        break;
    case 2:
        offset = 0x08;
        value = any_u32() % 4 ? any_u32() : 0;
        r->written.enable = value & 0x7F;
        break;
    case 3:
        offset = 0xE4;
        value = any_u32() % 4;
        r->sync_update = value & 1;
        break;
    case 4:
    case 5:
        offset = 0x10 + 8 * n;
        r->written.pos_edge[n] = value = any_u32() % 30;
        break;
    default:
        offset = 0x14 + 8 * n;
        r->written.neg_edge[n] = value = any_u32() % 3 ? any_u32() % 30 : r->written.pos_edge[n];
        break;
    }
    corepwm_write(c, offset, value);
}

static bool reads_agree(const struct corepwm *c, const struct reference *r)
{
    bool same = corepwm_read(c, 0x00) == r->active.prescale && corepwm_read(c, 0x04) == r->active.period &&
                corepwm_read(c, 0x08) == r->active.enable;
    for (unsigned n = 0; n < 7; n++) {
        same = same && corepwm_read(c, 0x10 + 8 * n) == r->active.pos_edge[n] &&
               corepwm_read(c, 0x14 + 8 * n) == r->active.neg_edge[n];
    }
    return same;
}

static void reach(struct corepwm *c, sim_ps now)
{
    while (corepwm_next_event(c) <= now) {
        corepwm_take_event(c);
    }
    corepwm_catch_up(c, now);
}

struct tally {
    int64_t clocks, outputs_differ, reads_differ, changes, early_rises;
};

/* `promise`: before that time, the core said, output 7 does not rise. QEMU runs unattended until then. */
static void compare_run(struct tally *t)
{
    struct corepwm c;
    struct reference r;
    sim_ps promise = 0;
    corepwm_reset(&c, 0);
    reference_reset(&r);
    for (sim_ps clock = 1; clock < CLOCKS_PER_RUN; clock++) {
        sim_ps now = clock * SIM_PS_PER_FABRIC_CLOCK;
        unsigned before = r.outputs;
        reference_clock(&r);
        reach(&c, now);
        t->clocks++;
        t->outputs_differ += c.outputs != r.outputs;
        t->changes += before != r.outputs;
        t->reads_differ += !reads_agree(&c, &r);
        t->early_rises += (r.outputs & ~before & 0x40) && now < promise;
        uint32_t enable = r.written.enable;
        if (any_u32() % 20 == 0) {
            write_both(&c, &r);
        }
        if (now >= promise || r.written.enable != enable) {
            promise = corepwm_next_rise(&c, 6);
        }
    }
}

static void random_writes(void)
{
    struct tally t = {0};
    for (int run = 0; run < RUNS; run++) {
        compare_run(&t);
    }
    check_equal("clocks compared", t.clocks, RUNS * (CLOCKS_PER_RUN - 1));
    check_between("output changes seen", (double)t.changes, 0.03 * (double)t.clocks, (double)t.clocks);
    check_equal("clocks with other outputs than the reference", t.outputs_differ, 0);
    check_equal("clocks with other register contents than the reference", t.reads_differ, 0);
    check_equal("rises of the trigger before the promised time", t.early_rises, 0);
}

static void start(struct corepwm *c, uint32_t period, uint32_t pos_edge, uint32_t neg_edge)
{
    corepwm_reset(c, 0);
    corepwm_write(c, 0x00, 0);
    corepwm_write(c, 0x04, period);
    corepwm_write(c, 0x10, pos_edge);
    corepwm_write(c, 0x14, neg_edge);
    corepwm_write(c, 0xE4, 1);
    corepwm_write(c, 0x08, 1);
    reach(c, 81 * SIM_PS_PER_FABRIC_CLOCK); /* the reset period: 9 counts of 9 clocks */
}

/* Output 1 at a clock counted from the first period with the new registers. */
static unsigned output_at(struct corepwm *c, sim_ps clock)
{
    reach(c, (81 + clock) * SIM_PS_PER_FABRIC_CLOCK);
    return c->outputs & 1;
}

static void by_hand(void)
{
    struct corepwm c;
    start(&c, 9, 3, 7);
    check_equal("low before POSEDGE", output_at(&c, 2), 0);
    check_equal("high from POSEDGE on", output_at(&c, 3), 1);
    check_equal("high before NEGEDGE", output_at(&c, 6), 1);
    check_equal("low from NEGEDGE on", output_at(&c, 7), 0);
    check_equal("again in the next period", output_at(&c, 13), 1);

    start(&c, 9, 4, 4);
    check_equal("equal edges: first period", output_at(&c, 5), 1);
    check_equal("equal edges: held over the period's end", output_at(&c, 13), 1);
    check_equal("equal edges: second period toggles back", output_at(&c, 15), 0);

    start(&c, 9, 3, 10);
    check_equal("a NEGEDGE beyond PERIOD never comes", output_at(&c, 1002), 1);
    start(&c, 9, 10, 3);
    check_equal("a POSEDGE beyond PERIOD never comes", output_at(&c, 1005), 0);
    start(&c, 9, 0, 9);
    check_equal("edge at 0", output_at(&c, 10), 1);
    check_equal("edge at PERIOD", output_at(&c, 19), 0);
}

static void shadowing(void)
{
    struct corepwm c;
    start(&c, 9, 3, 7);
    output_at(&c, 5);
    corepwm_write(&c, 0xE4, 0);
    corepwm_write(&c, 0x14, 9);
    check_equal("reads return the active edge", corepwm_read(&c, 0x14), 7);
    output_at(&c, 12);
    check_equal("without SYNC_UPDATE an edge waits", corepwm_read(&c, 0x14), 7);
    corepwm_write(&c, 0xE4, 1);
    check_equal("with SYNC_UPDATE it waits for the period's end", corepwm_read(&c, 0x14), 7);
    output_at(&c, 20);
    check_equal("and then acts", corepwm_read(&c, 0x14), 9);
    corepwm_write(&c, 0x04, 19);
    check_equal("PERIOD waits for the period's end", corepwm_read(&c, 0x04), 9);
    output_at(&c, 30);
    check_equal("and then acts, whatever SYNC_UPDATE is", corepwm_read(&c, 0x04), 19);
    corepwm_write(&c, 0x08, 0);
    check_equal("an enable waits for the period's end", output_at(&c, 35), 1);
    check_equal("a disabled output is low", output_at(&c, 55), 0);
    check_equal("SYNC_UPDATE reads 0", corepwm_read(&c, 0xE4), 0);
}

/* With every channel off there are no events, but the periods go on and writes take effect at their ends. */
static void asleep(void)
{
    struct corepwm c;
    corepwm_reset(&c, 0);
    check_hex("PRESCALE after reset", corepwm_read(&c, 0x00), 8);
    check_hex("PERIOD after reset", corepwm_read(&c, 0x04), 8);
    check_true("all off: no events", corepwm_next_event(&c) == SIM_NEVER);
    corepwm_write(&c, 0x04, 0xFFFFFFFF);
    corepwm_write(&c, 0x00, 0xFFFFFFFF);
    reach(&c, 81 * SIM_PS_PER_FABRIC_CLOCK);
    check_hex("the longest period", corepwm_read(&c, 0x04), 0xFFFFFFFF);
    corepwm_write(&c, 0x08, 1);
    check_true("its end does not overflow the clock", corepwm_next_event(&c) == SIM_NEVER);
}

int main(void)
{
    random_writes();
    by_hand();
    shadowing();
    asleep();
    return check_end();
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The PWM, which the twin computes from event to event, against one that goes from clock to clock: registers as the RTL has
 * them (drivers/fabric/rtl/pwm*.v), all of which take their next value at once, with none of the twin's shortcuts. Small
 * periods, so that compares at an end and beyond it, pulses too short, and writes just before and after each of them come up
 * all the time. Then what the page promises, in numbers. */
#include "pwm.h"

#include <string.h>

#include "check.h"

#define RUNS           400
#define CLOCKS_PER_RUN 3000

struct access {
    bool writes, live;
    uint32_t offset, value;
};

struct reference_leg {
    bool side, on;
    uint32_t left;
};

struct reference {
    uint32_t control, period, dead, min_pulse, mode, phase, trigger[2], compare[3], active[3];
    bool fresh, waiting[3], fell_back[3], running, rising, live, triggered;
    uint32_t count, last;
    struct reference_leg leg[3];
};

static void reference_reset(struct reference *r)
{
    memset(r, 0, sizeof *r);
    r->period = r->phase = r->count = 2500;
    r->dead = r->min_pulse = 255;
    for (int k = 0; k < 3; k++) {
        r->leg[k].left = 255;
    }
}

static bool wished(const struct reference *r, uint32_t compare)
{
    return r->rising ? r->count < compare : r->count <= compare;
}

static bool enabled(const struct reference *r)
{
    return r->live && (r->running || (r->control & 2));
}

static unsigned outputs(const struct reference *r)
{
    unsigned out = 0;
    for (int k = 0; k < 3; k++) {
        out |= enabled(r) && r->leg[k].on ? (r->leg[k].side ? 1u : 2u) << (2 * k) : 0u;
    }
    return out;
}

/* The registers' next values, of a leg, of a compare, of the carrier, of what is written; r is the present, n the next. */
static void clock_leg(const struct reference *r, struct reference *n, int k)
{
    const struct reference_leg *leg = &r->leg[k];
    bool wish = r->running && !(r->control & 2) && wished(r, r->active[k]);
    if (!enabled(r)) {
        n->leg[k] = (struct reference_leg){wish, false, r->dead};
    } else if (leg->left / 2 != 0) {
        n->leg[k].left = leg->left - 1;
    } else if (!leg->on) {
        n->leg[k] = (struct reference_leg){leg->side, true, r->min_pulse};
    } else if (wish != leg->side) {
        n->leg[k] = (struct reference_leg){wish, false, r->dead};
    }
}

static void clock_compare(const struct reference *r, struct reference *n, int k, const struct access *a, bool load)
{
    bool once = r->mode & 2, commits = a->writes && a->offset == 0x30;
    bool withdraws = a->writes && (a->offset == 0x28 || a->offset == 0x2C);
    bool ahead = wished(r, r->active[k]) == r->rising && wished(r, r->compare[k]) == r->rising;
    bool take = r->waiting[k] && (!r->running || load || (once && r->fresh && ahead));
    n->fresh = commits;
    n->active[k] = take ? r->compare[k] : r->active[k];
    n->waiting[k] = commits || (r->waiting[k] && !take && !withdraws);
    n->fell_back[k] = r->fresh ? once && !take : r->fell_back[k];
}

static void clock_carrier(const struct reference *r, struct reference *n, bool to_valley, bool to_peak)
{
    n->last = r->period == 0 ? 0 : r->period - 1;
    if (!(r->control & 1) || !r->running) {
        n->running = r->control & 1;
        n->count = r->phase & 0xFFFF;
        n->rising = r->phase >> 16;
    } else if (to_valley || to_peak) {
        n->count = to_valley ? r->period : 0;
        n->rising = to_peak;
    } else {
        n->count = (r->count + (r->rising ? 1 : 0xFFFF)) & 0xFFFF;
    }
}

static void clock_registers(const struct reference *r, struct reference *n, const struct access *a)
{
    bool locked = (r->control & 3) || r->running;
    uint32_t *const setting[] = {&n->period, &n->dead, &n->min_pulse, &n->mode, &n->phase};
    static const uint32_t bits[] = {0xFFFF, 0xFF, 0xFF, 3, 0x1FFFF};
    n->live = a->live;
    if (!a->writes) {
        return;
    }
    if (a->offset == 0x00) {
        n->control = a->value & 7;
    } else if (a->offset >= 0x08 && a->offset <= 0x18) {
        uint32_t i = (a->offset - 8) / 4;
        *setting[i] = locked ? *setting[i] : a->value & bits[i];
    } else if (a->offset == 0x1C || a->offset == 0x20) {
        n->trigger[a->offset == 0x20] = a->value & 0x3FFFF;
    } else if (a->offset >= 0x28 && a->offset <= 0x30) {
        n->compare[(a->offset - 0x28) / 4] = a->value & 0xFFFF;
    }
}

static void reference_clock(struct reference *r, const struct access *a)
{
    struct reference n = *r;
    bool to_valley = r->running && r->rising && r->count >= r->last;
    bool to_peak = r->running && !r->rising && r->count <= 1;
    n.triggered = false;
    for (int t = 0; t < 2; t++) {
        bool chosen = r->trigger[t] & (r->rising ? 0x20000u : 0x10000u);
        n.triggered = n.triggered || (r->running && chosen && r->count == (r->trigger[t] & 0xFFFF));
    }
    for (int k = 0; k < 3; k++) {
        clock_leg(r, &n, k);
        clock_compare(r, &n, k, a, to_valley || (to_peak && r->mode != 0));
    }
    clock_carrier(r, &n, to_valley, to_peak);
    clock_registers(r, &n, a);
    *r = n;
}

static uint32_t reference_read(const struct reference *r, uint32_t offset)
{
    const uint32_t status =
        (r->running ? 1u : 0u) | (r->rising ? 2u : 0u) | (r->waiting[0] || r->waiting[1] || r->waiting[2] ? 4u : 0u) |
        (r->fell_back[0] ? 0x10u : 0u) | (r->fell_back[1] ? 0x20u : 0u) | (r->fell_back[2] ? 0x40u : 0u);
    const uint32_t values[] = {r->control,    status,        r->period,     r->dead,       r->min_pulse,
                               r->mode,       r->phase,      r->trigger[0], r->trigger[1], r->count,
                               r->compare[0], r->compare[1], r->compare[2]};
    return offset <= 0x30 && offset % 4 == 0 ? values[offset / 4] : 0;
}

/* ---- both beside each other ---- */

/* Seldom off for long, and all settings small. */
static struct access any_access(bool live)
{
    struct access a = {.live = any_u32() % 300 == 0 ? !live : live, .writes = any_u32() % 12 == 0};
    if (!a.writes) {
        return a;
    }
    a.offset = 4 * (any_u32() % 15);
    a.value = any_u32() % 45;
    if (any_u32() % 2) {
        a.offset = 0x28 + 4 * (any_u32() % 3);
    } else if (a.offset == 0x00) {
        a.value = any_u32() % 6 == 0 ? any_u32() : 1;
    } else if (a.offset == 0x0C || a.offset == 0x10) {
        a.value = any_u32() % 9;
    } else if (a.offset == 0x1C || a.offset == 0x20 || a.offset == 0x18) {
        a.value |= any_u32() << 16;
    }
    return a;
}

struct tally {
    int64_t clocks, outputs_differ, reads_differ, triggers_differ, changes, triggers, late_promises, fell_back;
};

static bool reach(struct pwm *p, sim_ps now)
{
    bool triggered = false;
    while (pwm_next_event(p) <= now) {
        triggered = pwm_take_event(p) || triggered;
    }
    pwm_catch_up(p, now);
    return triggered;
}

static void compare_clock(struct tally *t, struct pwm *p, struct reference *r, sim_ps now, const struct access *a)
{
    sim_ps promise = pwm_next_trigger(p);
    unsigned before = outputs(r);
    reference_clock(r, a);
    bool triggered = reach(p, now);
    pwm_set_live(p, a->live);
    if (a->writes) {
        pwm_write(p, a->offset, a->value);
    }
    t->clocks++;
    t->outputs_differ += p->outputs != outputs(r);
    t->changes += before != outputs(r);
    t->triggers += r->triggered;
    t->triggers_differ += triggered != r->triggered;
    t->late_promises += r->triggered && now < promise;
    t->fell_back += r->fell_back[0];
    for (uint32_t offset = 0; offset < 0x40; offset += 4) {
        t->reads_differ += pwm_read(p, offset) != reference_read(r, offset);
    }
}

static void random_writes(void)
{
    struct tally t = {0};
    for (int run = 0; run < RUNS; run++) {
        struct pwm p = {0};
        struct reference r;
        struct access a = {.live = false};
        pwm_reset(&p, 0);
        reference_reset(&r);
        /* a period within sight from the start */
        const struct access first[] = {{true, false, 0x08, 3 + any_u32() % 38}, {true, false, 0x18, any_u32() % 40},
                                       {true, false, 0x0C, any_u32() % 9},      {true, false, 0x10, any_u32() % 9},
                                       {true, false, 0x14, any_u32() % 4},      {true, true, 0x00, 1}};
        for (int64_t clock = 1; clock <= CLOCKS_PER_RUN; clock++) {
            a = clock <= 6 ? first[clock - 1] : any_access(a.live);
            compare_clock(&t, &p, &r, clock * SIM_PS_PER_FABRIC_CLOCK, &a);
        }
    }
    check_equal("clocks compared", t.clocks, RUNS * CLOCKS_PER_RUN);
    check_between("output changes seen", (double)t.changes, 0.05 * (double)t.clocks, (double)t.clocks);
    check_between("triggers seen", (double)t.triggers, 0.01 * (double)t.clocks, (double)t.clocks);
    check_between("clocks after a compare that fell back", (double)t.fell_back, 0.01 * (double)t.clocks,
                  (double)t.clocks);
    check_equal("clocks with other outputs than the reference", t.outputs_differ, 0);
    check_equal("registers other than the reference's", t.reads_differ, 0);
    check_equal("clocks with another trigger than the reference", t.triggers_differ, 0);
    check_equal("triggers before the promised time", t.late_promises, 0);
}

/* ---- what the page says ---- */

static const sim_ps clock_ps = SIM_PS_PER_FABRIC_CLOCK;

static void start(struct pwm *p, uint32_t half, uint32_t dead, uint32_t min_pulse, uint32_t compare)
{
    memset(p, 0, sizeof *p);
    pwm_reset(p, 0);
    pwm_write(p, 0x08, half);
    pwm_write(p, 0x0C, dead);
    pwm_write(p, 0x10, min_pulse);
    pwm_write(p, 0x18, half);
    for (uint32_t k = 0; k < 3; k++) {
        pwm_write(p, 0x28 + 4 * k, compare);
    }
    pwm_set_live(p, true);
    pwm_write(p, 0x00, 1);
}

/* Clocks of a period for which an output is on, in the steady state. */
static void count_on(struct pwm *p, uint32_t half, int64_t *high, int64_t *low)
{
    *high = *low = 0;
    for (int64_t n = 4 * half; n < 6 * half; n++) {
        reach(p, n * clock_ps);
        *high += p->outputs & 1u;
        *low += (p->outputs >> 1) & 1u;
    }
}

static void on_times(void)
{
    static const struct {
        uint32_t compare;
        int64_t high, low;
        const char *name;
    } cases[] = {{40, 70, 110, "40 of 100, dead time 10: on for 80 less 10, the other side for 120 less 10"},
                 {0, 0, 200, "compare 0: never on"},
                 {100, 200, 0, "compare PERIOD: always on"},
                 {65535, 200, 0, "and beyond it"},
                 {5, 4, 176, "a pulse that the dead time eats: stretched to the shortest, not lost"},
                 {95, 176, 4, "the same of the low side"},
                 {7, 4, 176, "exactly the shortest"}};
    for (size_t n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        struct pwm p;
        int64_t high, low;
        start(&p, 100, 10, 4, cases[n].compare);
        count_on(&p, 100, &high, &low);
        check_equal(cases[n].name, 1000 * high + low, 1000 * cases[n].high + cases[n].low);
    }
}

static void locked(void)
{
    static const struct {
        uint32_t offset, other;
        const char *name;
    } settings[] = {
        {0x08, 50, "PERIOD"}, {0x0C, 1, "DEAD"}, {0x10, 1, "MIN_PULSE"}, {0x14, 1, "MODE"}, {0x18, 7, "PHASE"}};
    struct pwm p;
    start(&p, 100, 10, 4, 40);
    reach(&p, 300 * clock_ps);
    for (size_t n = 0; n < 5; n++) {
        uint32_t before = pwm_read(&p, settings[n].offset);
        pwm_write(&p, settings[n].offset, settings[n].other);
        check_equal("a write while it runs is ignored", pwm_read(&p, settings[n].offset), before);
    }
    pwm_write(&p, 0x00, 0);
    pwm_write(&p, 0x08, 50);
    check_equal("still in the clock in which it stops", pwm_read(&p, 0x08), 100);
    reach(&p, 303 * clock_ps);
    for (size_t n = 0; n < 5; n++) {
        pwm_write(&p, settings[n].offset, settings[n].other);
        check_equal("taken at rest", pwm_read(&p, settings[n].offset), settings[n].other);
    }
    pwm_write(&p, 0x00, 2);
    pwm_write(&p, 0x0C, 9);
    check_equal("ignored while it brakes", pwm_read(&p, 0x0C), 1);
}

static void update_at_the_valley(void)
{
    struct pwm p;
    start(&p, 100, 10, 4, 40);
    reach(&p, 210 * clock_ps); /* a few clocks after a valley */
    pwm_write(&p, 0x28, 50);
    pwm_write(&p, 0x2C, 50);
    check_hex("nothing waits before the third", pwm_read(&p, 0x04) & 4, 0);
    pwm_write(&p, 0x30, 50);
    check_hex("the third commits", pwm_read(&p, 0x04) & 4, 4);
    reach(&p, 400 * clock_ps);
    check_hex("and waits for the valley", pwm_read(&p, 0x04) & 4, 4);
    reach(&p, 402 * clock_ps);
    check_hex("which takes it", pwm_read(&p, 0x04) & 4, 0);
    pwm_write(&p, 0x30, 60);
    pwm_write(&p, 0x28, 20);
    check_hex("a write of the next set withdraws one that waits", pwm_read(&p, 0x04) & 4, 0);
}

static void brake(void)
{
    struct pwm p;
    start(&p, 100, 10, 4, 100);
    pwm_write(&p, 0x00, 0);
    reach(&p, 50 * clock_ps);
    check_hex("at rest: all off", p.outputs, 0);
    pwm_write(&p, 0x00, 2);
    reach(&p, 59 * clock_ps);
    check_hex("not before a dead time", p.outputs, 0);
    reach(&p, 62 * clock_ps);
    check_hex("BRAKE: the low sides, and no high side first, whatever the compares say", p.outputs, 0x2A);
    pwm_set_live(&p, false);
    check_hex("and off at once without LIVE", p.outputs, 0);
}

static void after_reset(void)
{
    static const uint32_t values[] = {0, 0, 2500, 255, 255, 0, 2500, 0, 0, 2500, 0, 0, 0, 0};
    struct pwm p = {.live = true};
    pwm_reset(&p, 12345);
    for (uint32_t n = 0; n < sizeof values / sizeof values[0]; n++) {
        check_hex("registers after a reset", pwm_read(&p, 4 * n), values[n]);
    }
    check_true("nothing comes by itself", pwm_next_event(&p) == SIM_NEVER);
    check_true("and no trigger", pwm_next_trigger(&p) == SIM_NEVER);
}

int main(void)
{
    random_writes();
    on_times();
    locked();
    update_at_the_valley();
    brake();
    after_reset();
    return check_end();
}

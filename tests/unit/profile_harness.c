/* SPDX-License-Identifier: MIT */
/*
 * The profile under random targets: reads limits and a number of steps, gives new targets at random instants, and holds each
 * step to the limits by the sums before the division, which are exact. Then a last target, and its end to the unit.
 *   profile_harness random SEED STEPS     prints the number of retargets, or what was broken
 *   profile_harness move V A WINDOW DISTANCE      prints the steps until it stands and the end
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/control/profile.h"

static uint64_t state;

static uint64_t next_random(void)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return state;
}

static int64_t within(int64_t low, int64_t high)
{
    return low + (int64_t)(next_random() % (uint64_t)(high - low + 1));
}

static struct tuning_profile limits_of(int32_t v, int32_t a, int32_t window)
{
    return (struct tuning_profile){.v_max = v, .a_max = a, .window = window, .window_q30 = (1 << 30) / window};
}

static int fail(const char *what, int64_t is, int64_t limit, uint64_t step)
{
    printf("%s %" PRId64 " beyond %" PRId64 " in step %" PRIu64 "\n", what, is, limit, step);
    return 1;
}

/* What the sums tell, N times the mean: nothing is rounded there. A creeping step may add one unit to a change. */
struct watch {
    int64_t sum, change;
};

static int hold(struct watch *w, const struct profile *p, const struct tuning_profile *t, int64_t v_limit,
                uint64_t step)
{
    const int64_t n = t->window;
    const int64_t change = p->sum - w->sum;
    const int64_t jerk = change - w->change;
    if (llabs(p->sum) > n * v_limit) {
        return fail("speed", p->sum, n * v_limit, step);
    }
    if (llabs(change) > n * t->a_max) {
        return fail("acceleration", change, n * t->a_max, step);
    }
    if (llabs(jerk) > t->a_max + 1) {
        return fail("jerk", jerk, t->a_max + 1, step);
    }
    if (p->carry < 0 || p->carry >= t->window || p->steps * t->a_max != p->level) {
        return fail("carry or level", p->carry, t->window, step);
    }
    *w = (struct watch){p->sum, change};
    return 0;
}

/* Steps until it stands at its target; -1 when it never does. */
static int64_t finish(struct profile *p, const struct tuning_profile *t, struct watch *w, int64_t v_limit)
{
    for (int64_t step = 1; step < 40000000; step++) {
        profile_step(p, t);
        if (hold(w, p, t, v_limit, (uint64_t)step) != 0) {
            return -1;
        }
        if (profile_is_done(p)) {
            return step;
        }
    }
    return -1;
}

/* One life: limits, a beginning, targets now and then, an end. Returns how many targets there were, -1 when it failed. */
static int64_t live(uint64_t steps)
{
    const int32_t a = (int32_t)within(1, (int64_t)1 << within(1, 21));
    const int32_t v = (int32_t)within(a, (int64_t)1 << 22);
    const struct tuning_profile t = limits_of(v, a, (int32_t)within(1, within(1, PARAM_JERK_MOST_MS)));
    const int64_t fastest =
        a < 1 << 12 ? 1000 * (int64_t)a : (int64_t)1 << 22; /* it can stop within a test's patience */
    const int32_t speed = (int32_t)within(-fastest, fastest);
    const int64_t v_limit = llabs(speed) > v ? llabs(speed) : v;
    struct profile p;
    int64_t targets = 0;
    profile_begin(&p, &t, within(-1000000, 1000000), speed);
    struct watch w = {p.sum, 0};
    const int64_t reach = (int64_t)1 << within(1, 36);
    const int64_t often = within(1, 400);
    for (uint64_t step = 0; step < steps; step++) {
        if (within(1, often) == 1) {
            profile_aim(&p, p.position + within(-reach, reach));
            targets++;
        }
        profile_step(&p, &t);
        if (hold(&w, &p, &t, v_limit, step) != 0) {
            printf("v %d a %d window %d speed %d\n", v, a, t.window, speed);
            return -1;
        }
    }
    profile_aim(&p, p.position + within(-1000 * (int64_t)v, 1000 * (int64_t)v));
    if (finish(&p, &t, &w, v_limit) < 0) {
        printf("no end: v %d a %d window %d left %" PRId64 "\n", v, a, t.window, p.target - p.position);
        return -1;
    }
    return targets;
}

static int run_random(uint64_t seed, int64_t wanted)
{
    int64_t targets = 0;
    state = seed * 0x9E3779B97F4A7C15u + 1u;
    while (targets < wanted) {
        const int64_t more = live(4000);
        if (more < 0) {
            return 1;
        }
        targets += more;
    }
    printf("%" PRId64 "\n", targets);
    return 0;
}

static int run_move(char **words)
{
    const struct tuning_profile t = limits_of(atoi(words[0]), atoi(words[1]), atoi(words[2]));
    struct profile p;
    profile_begin(&p, &t, 0, 0);
    profile_aim(&p, atoll(words[3]));
    struct watch w = {0, 0};
    const int64_t steps = finish(&p, &t, &w, t.v_max);
    printf("%" PRId64 " %" PRId64 "\n", steps, p.position);
    return steps < 0;
}

int main(int count, char **words)
{
    if (count == 4 && strcmp(words[1], "random") == 0) {
        return run_random(strtoull(words[2], NULL, 10), atoll(words[3]));
    }
    return count == 6 && strcmp(words[1], "move") == 0 ? run_move(&words[2]) : 2;
}

/* SPDX-License-Identifier: MIT */
#include "firmware/control/profile.h"

#include "lib/q15.h"

/* A speed of the trapezoid, without its sign, in the direction of motion. */
struct gait {
    int32_t speed;
    int32_t steps; /* k */
    int32_t level; /* k a <= speed < (k + 1) a */
};

/* Stopping distance: that speed, then a less in each step: (k + 1) speed - a k (k + 1) / 2. */
static int64_t stopping_distance(const struct gait *g)
{
    return ((int64_t)g->level * (g->steps + 1) >> 1) + (int64_t)(g->steps + 1) * (g->speed - g->level);
}

/* The same, if it must hold that speed for another `held` steps first. */
static int64_t holding_distance(const struct gait *g, int32_t held)
{
    return stopping_distance(g) + (int64_t)held * g->speed;
}

/* `speed` differs from that of `g` by a at most. */
static struct gait gait_beside(const struct gait *g, int32_t speed, int32_t a)
{
    struct gait other = {speed, g->steps, g->level};
    if (speed >= g->level + a) {
        other.steps++;
        other.level += a;
    } else if (speed < g->level) {
        other.steps--;
        other.level -= a;
    }
    return other;
}

/*
 * The largest speed within a level whose distance, with the hold, does not exceed `distance`. The level itself does not
 * exceed it, the next one does: so the remainder is below a step for each summand, which fits.
 */
static int32_t fastest_within(int32_t level, int32_t steps, int32_t held, int64_t distance, int32_t a)
{
    const struct gait g = {level, steps, level};
    const int64_t left = distance - holding_distance(&g, held);
    const uint32_t summands = (uint32_t)(held + steps + 1);
    const uint32_t most = (uint32_t)(a - 1) * summands;
    return level + (int32_t)((left < (int64_t)most ? (uint32_t)left : most) / summands);
}

/* The same in the level of `g` and `up` more, or in the one below that; 0 if not even that one's distance does. */
static int32_t fastest(const struct gait *g, int32_t up, int32_t held, int64_t distance, int32_t a)
{
    for (int32_t n = up; n > up - 2 && g->steps + n >= 0; n--) {
        const struct gait level = {g->level + n * a, g->steps + n, g->level + n * a};
        if (holding_distance(&level, held) <= distance) {
            return fastest_within(level.level, level.steps, held, distance, a);
        }
    }
    return 0;
}

/* Slower: by a at most, and no slower than the remaining distance or the limit requires. */
static int32_t braked(const struct gait *g, int64_t distance, const struct tuning_profile *t)
{
    const int32_t least = q15_max(g->speed - t->a_max, 0);
    if (g->speed > t->v_max) {
        return q15_max(least, t->v_max);
    }
    return q15_clamp(fastest(g, 0, 0, distance, t->a_max), least, g->speed);
}

/* Faster: by a at most, but still able to stop in time after the required hold. */
static int32_t pushed(const struct gait *g, int64_t distance, const struct tuning_profile *t)
{
    const struct gait full = gait_beside(g, q15_min(g->speed + t->a_max, t->v_max), t->a_max);
    if (holding_distance(&full, t->window) <= distance) {
        return full.speed;
    }
    return q15_clamp(fastest(g, 1, t->window, distance, t->a_max), g->speed, full.speed);
}

/* Distances shorter than the window in units, far below a count, are crept. */
static int32_t begun(int32_t speed, int64_t distance)
{
    return speed == 0 && distance > 0 ? 1 : speed;
}

/* The trapezoid's next speed, in the direction of motion; `distance` is the remaining distance in it. */
static int32_t next_speed(const struct gait *g, int64_t distance, bool may_push, bool may_brake,
                          const struct tuning_profile *t)
{
    if (distance < stopping_distance(g) || g->speed > t->v_max) {
        return may_brake || g->speed == 1 ? braked(g, distance, t) : g->speed;
    }
    return may_push && g->speed < t->v_max ? begun(pushed(g, distance, t), distance) : g->speed;
}

static void step_trapezoid(struct profile *p, const struct tuning_profile *t)
{
    const int64_t left = p->target - p->corner;
    const bool down = p->corner_speed < 0 || (p->corner_speed == 0 && left < 0);
    const int32_t since_push = p->since[down ? 1 : 0];
    const int32_t since_brake = p->since[down ? 0 : 1];
    const struct gait now = {q15_abs(p->corner_speed), p->steps, p->level};
    const int32_t speed = next_speed(&now, down ? -left : left, since_brake > t->window, since_push > t->window, t);
    const struct gait next = gait_beside(&now, speed, t->a_max);
    const int32_t change = down ? now.speed - speed : speed - now.speed;
    p->since[0] = change > 0 ? 1 : q15_min(p->since[0] + 1, t->window + 1);
    p->since[1] = change < 0 ? 1 : q15_min(p->since[1] + 1, t->window + 1);
    p->corner_speed = down ? -speed : speed;
    p->steps = next.steps;
    p->level = next.level;
    p->corner += p->corner_speed;
}

/* The sum over the window divided by `window`, rounded down; the remainder goes into the next step, so nothing is lost. */
static int32_t window_mean(struct profile *p, const struct tuning_profile *t)
{
    const int32_t dividend = p->sum + p->carry;
    int32_t quotient = (int32_t)(((int64_t)dividend * t->window_q30) >> 30);
    int32_t rest = dividend - quotient * t->window;
    if (rest < 0) {
        quotient--;
        rest += t->window;
    } else if (rest >= t->window) {
        quotient++;
        rest -= t->window;
    }
    p->carry = rest;
    return quotient;
}

void profile_begin(struct profile *p, const struct tuning_profile *t, int64_t position, int32_t speed)
{
    const int32_t size = q15_abs(speed);
    p->target = position;
    p->position = position;
    p->speed = speed;
    /* the trapezoid leads its average by half of what the window holds; the half unit too much is carried */
    const int64_t ahead = (int64_t)speed * (t->window - 1);
    p->corner = position + ((ahead + (ahead & 1)) >> 1);
    p->carry = (ahead & 1) != 0 ? t->window / 2 : 0;
    p->corner_speed = speed;
    p->steps = size / t->a_max;
    p->level = p->steps * t->a_max;
    p->since[0] = t->window + 1;
    p->since[1] = t->window + 1;
    p->sum = speed * t->window;
    p->at = 0;
    for (int32_t n = 0; n < t->window; n++) {
        p->past[n] = speed;
    }
}

void profile_step(struct profile *p, const struct tuning_profile *t)
{
    step_trapezoid(p, t);
    p->sum += p->corner_speed - p->past[p->at];
    p->past[p->at] = p->corner_speed;
    p->at = p->at + 1 < t->window ? p->at + 1 : 0;
    p->speed = window_mean(p, t);
    p->position += p->speed;
}

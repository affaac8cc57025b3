/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "sto.h"

#define SYNC_CLOCKS 2

static int64_t lesser(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

/* Up to a clock, with the level as it has been. */
static void advance(struct sto_input *in, int64_t longest, int64_t to)
{
    int64_t clocks = to - in->at, room = in->low ? longest - in->count : in->count;
    if (clocks > room) {
        in->asks = in->low;
    }
    in->count += (in->low ? 1 : -1) * lesser(clocks, room);
    in->at = to;
}

static int64_t input_due(const struct sto_input *in, int64_t longest)
{
    int64_t room = in->low ? longest - in->count : in->count;
    return lesser(in->follows_at, in->low != in->asks ? in->at + room + 1 : INT64_MAX);
}

static bool differ(const struct sto *s)
{
    return s->input[0].asks != s->input[1].asks;
}

/* When the verdict that they are apart comes, or goes. */
static int64_t verdict_due(const struct sto *s)
{
    if (differ(s)) {
        return s->apart ? INT64_MAX : s->changed_at + s->patience + 1;
    }
    return s->apart && s->input[0].asks ? s->changed_at + 1 : INT64_MAX;
}

void sto_reset(struct sto *s, int64_t clock)
{
    for (int k = 0; k < 2; k++) {
        bool pin = s->input[k].pin;
        s->input[k] = (struct sto_input){.pin = pin, .follows_at = pin ? clock + SYNC_CLOCKS : INT64_MAX, .at = clock};
    }
    s->apart = false;
    s->changed_at = clock;
}

void sto_pin(struct sto *s, int input, bool low, int64_t clock)
{
    struct sto_input *in = &s->input[input];
    in->pin = low;
    in->follows_at = low == in->low ? INT64_MAX : clock + SYNC_CLOCKS;
}

int64_t sto_due(const struct sto *s)
{
    int64_t due = lesser(input_due(&s->input[0], s->longest), input_due(&s->input[1], s->longest));
    return lesser(due, verdict_due(s));
}

void sto_take(struct sto *s, int64_t clock)
{
    unsigned before = sto_asks(s);
    if (verdict_due(s) <= clock) {
        s->apart = differ(s);
    }
    for (int k = 0; k < 2; k++) {
        struct sto_input *in = &s->input[k];
        advance(in, s->longest, clock);
        if (in->follows_at <= clock) {
            in->low = in->pin;
            in->follows_at = INT64_MAX;
        }
    }
    if (((before ^ sto_asks(s)) & (STO_ASKS_A | STO_ASKS_B)) != 0) {
        s->changed_at = clock;
    }
}

unsigned sto_asks(const struct sto *s)
{
    return (s->input[0].asks ? STO_ASKS_A : 0u) | (s->input[1].asks ? STO_ASKS_B : 0u) |
           (s->apart ? STO_ASKS_APART : 0u);
}

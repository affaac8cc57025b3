/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "watch.h"

#define SLOW_KEY   0x5A17C300u
#define THREAD_KEY 0xA5E83C00u
#define LATCHES    2 /* clocks behind CLOCKS: until the counter has run out, and until the latch shows it */

static bool watches(const struct watch *w)
{
    return w->started && w->armed;
}

static void begin_round(struct watch *w, sim_ps now)
{
    w->late_at = watches(w) ? now + ((sim_ps)w->clocks + LATCHES) * SIM_PS_PER_FABRIC_CLOCK : SIM_NEVER;
}

void watch_reset(struct watch *w)
{
    *w = (struct watch){.answered = true, .late_at = SIM_NEVER};
}

void watch_start(struct watch *w, uint32_t clocks)
{
    if (!w->started && !w->armed) {
        w->started = true;
        w->clocks = clocks;
    }
}

void watch_arm(struct watch *w, bool armed, bool was_live, sim_ps now)
{
    bool begins = armed && !w->armed;
    w->armed = armed;
    w->answered = w->answered || !was_live;
    if (begins || !armed) {
        begin_round(w, now);
    }
}

void watch_disarm(struct watch *w)
{
    w->armed = false;
    w->late_at = SIM_NEVER;
}

bool watch_prove(struct watch *w, uint32_t word, sim_ps now)
{
    if (word != ((w->thread ? THREAD_KEY : SLOW_KEY) | w->number)) {
        return watches(w);
    }
    if (w->thread) {
        w->number++;
    } else {
        begin_round(w, now);
    }
    w->thread = !w->thread;
    return false;
}

bool watch_valley(struct watch *w)
{
    bool answered = w->answered;
    w->answered = false;
    return w->started && !answered;
}

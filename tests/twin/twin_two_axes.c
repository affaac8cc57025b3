/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Two plants behind one fabric: the second's carrier starts with a valley of the first's; nothing else of one is seen in the
 * other. */
#include "bench.h"
#include "check.h"

enum { PWM_STATUS = 0x0004, PWM_PHASE = 0x0018, PWM_COUNT = 0x0024 };
enum { RUN = 1, FOLLOW = 4, RUNNING = 1, FIRST_OF_TWO = 0x20, SECOND_OF_TWO = 0x21 };

#define HALF       (BENCH_PERIOD_COUNTS / 2)
#define AHEAD      (HALF / 2) /* a quarter of a period */
#define AT_VALLEY  (HALF | 1u << 16)
#define CLOCK_PS   ((sim_ps)SIM_PS_PER_FABRIC_CLOCK)
#define WAITS_FROM (100 * CLOCK_PS)

struct pair {
    struct plant first, second;
};

static uint32_t get(struct plant *p, int offset)
{
    return bench_read(p, (enum bench_register)offset);
}

static void put(struct plant *p, int offset, uint32_t value)
{
    bench_write(p, (enum bench_register)offset, value);
}

static void set_up(struct plant *p, uint32_t phase)
{
    put(p, PWM_PERIOD, HALF);
    put(p, PWM_PHASE, phase);
    put(p, PWM_TRIGGER_1, AT_VALLEY);
}

/* The first runs from its valley at time 0 on, or rests; the second begins to wait a little later. */
static void begin(struct pair *two, bool first_runs)
{
    const struct plant_params params = bench_plant();
    plant_init(&two->first, &params);
    plant_init(&two->second, &params);
    plant_join(&two->first, 0, 2, NULL);
    plant_join(&two->second, 1, 2, &two->first);
    set_up(&two->first, HALF);
    set_up(&two->second, HALF - AHEAD);
    put(&two->first, PWM_CONTROL, first_runs ? RUN : 0);
    plant_advance(&two->second, WAITS_FROM);
    put(&two->second, PWM_CONTROL, RUN | FOLLOW);
}

static void who_is_who(void)
{
    struct pair two;
    begin(&two, true);
    check_hex("axis 1 says that it is the first of two", get(&two.first, GATE_AXES), FIRST_OF_TWO);
    check_hex("axis 2 that it is the second", get(&two.second, GATE_AXES), SECOND_OF_TWO);
}

/* In the clock of the write the first carrier rests, then it passes its valley, and the next one a period later. */
static void starts_with_the_valley(void)
{
    struct pair two;
    begin(&two, true);
    const sim_ps valley = BENCH_PERIOD_PS + CLOCK_PS;
    check_true("its carrier waits", plant_waits(&two.second) && !plant_waits(&two.first));
    check_equal("its trigger is known beforehand: a quarter of a period before the first's",
                plant_next_trigger(&two.second), valley + BENCH_PERIOD_PS - BENCH_PERIOD_PS / 4 + CLOCK_PS);
    plant_advance(&two.second, valley - CLOCK_PS);
    check_equal("a clock before the valley it rests", get(&two.second, PWM_STATUS) & RUNNING, 0);
    plant_advance(&two.second, valley);
    check_equal("there it runs", get(&two.second, PWM_STATUS) & RUNNING, RUNNING);
    check_equal("from its PHASE on", get(&two.second, PWM_COUNT), HALF - AHEAD);
    plant_advance(&two.first, valley);
    check_equal("while the first is at its PERIOD", get(&two.first, PWM_COUNT), HALF);
    plant_advance(&two.first, valley + 1000 * BENCH_PERIOD_PS + BENCH_PERIOD_PS / 4);
    plant_advance(&two.second, valley + 1000 * BENCH_PERIOD_PS + BENCH_PERIOD_PS / 4);
    check_equal("a thousand periods later as far apart",
                plant_next_trigger(&two.first) - plant_next_trigger(&two.second), BENCH_PERIOD_PS / 4);
}

static void waits_for_a_start(void)
{
    struct pair two;
    begin(&two, false);
    check_true("nothing is due while the first rests", plant_next_trigger(&two.second) == SIM_NEVER);
    plant_advance(&two.second, 10 * BENCH_PERIOD_PS);
    plant_advance(&two.first, 10 * BENCH_PERIOD_PS);
    check_equal("and the carrier waits", get(&two.second, PWM_STATUS) & RUNNING, 0);
    put(&two.first, PWM_CONTROL, RUN);
    plant_advance(&two.second, 11 * BENCH_PERIOD_PS);
    check_equal("the first's start at its valley is no valley", get(&two.second, PWM_STATUS) & RUNNING, 0);
    plant_advance(&two.second, 11 * BENCH_PERIOD_PS + CLOCK_PS);
    check_equal("its first valley is", get(&two.second, PWM_STATUS) & RUNNING, RUNNING);
}

static void a_reset_keeps_the_leader(void)
{
    struct pair two;
    begin(&two, true);
    plant_reset_fabric(&two.second);
    check_equal("a reset ends the waiting", plant_waits(&two.second), 0);
    set_up(&two.second, HALF);
    put(&two.second, PWM_CONTROL, RUN | FOLLOW);
    check_true("and it can follow anew", plant_waits(&two.second));
}

static void the_first_follows_nobody(void)
{
    struct pair two;
    begin(&two, false);
    put(&two.first, PWM_CONTROL, RUN | FOLLOW);
    plant_advance(&two.first, 2 * CLOCK_PS);
    check_equal("FOLLOW has no effect on axis 1", get(&two.first, PWM_STATUS) & RUNNING, RUNNING);
}

static void stops_are_its_own(void)
{
    struct pair two;
    begin(&two, true);
    put(&two.first, GATE_CONTROL, 1);
    put(&two.second, GATE_CONTROL, 1);
    plant_stop(&two.second, GATE_DRIVER_FAULT, true);
    check_true("a driver's fault of one leaves the other live", !two.second.fabric->live && two.first.fabric->live);
}

int main(void)
{
    who_is_who();
    starts_with_the_valley();
    waits_for_a_start();
    a_reset_keeps_the_leader();
    the_first_follows_nobody();
    stops_are_its_own();
    return check_end();
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The watch over the program at the plant: when the last gate goes off after each of the program's parts has stopped. */
#include "bench.h"
#include "check.h"

enum { WATCH_TIME = 0x31C, WATCH = 0x320, PROOF = 0x324 };
enum { LIVE = 1u << 0, LOOP_LOST = 1u << 3, SLOW_LOST = 1u << 15, THREAD_LOST = 1u << 16, THREADS_TURN = 0x100 };

#define STARTED    (1u << 31)
#define CLOCKS     350000u /* 3.5 ms */
#define SLOW_KEY   0x5A17C300u
#define THREAD_KEY 0xA5E83C00u
#define PERIOD_US  50
#define SLOW_US    1000
#define THREAD_US  1300 /* its answers come later and later, and at times every second one */
#define WRITTEN_US 4    /* behind the valley: the compares */
#define LIVES_US   12000
#define OVER_US    7000

/* The program's parts, each of which lives or not, and what of the plant was seen. */
struct program {
    struct plant p;
    bool loop, slow, thread;
    int us;      /* since it began */
    int last_on; /* the last microsecond in which a gate was on */
};

static uint32_t get(struct program *g, int offset)
{
    return bench_read(&g->p, (enum bench_register)offset);
}

static void put(struct program *g, int offset, uint32_t value)
{
    bench_write(&g->p, (enum bench_register)offset, value);
}

static void prove(struct program *g, uint32_t key, uint32_t turn)
{
    uint32_t next = get(g, WATCH);
    if ((next & THREADS_TURN) == turn) {
        put(g, PROOF, key | (next & 0xFF));
    }
}

/* Steps of a microsecond where the gates are looked at, else of as many as nothing is written in. */
static void run(struct program *g, int us, bool looks)
{
    int behind = 0;
    for (int end = g->us + us; g->us < end; g->us++) {
        bool compares = g->loop && g->us % PERIOD_US == WRITTEN_US;
        bool slow = g->slow && g->us % SLOW_US == 0, thread = g->thread && g->us % THREAD_US == 7;
        if (compares || slow || thread || looks) {
            bench_run(&g->p, behind * 1e-6);
            behind = 0;
        }
        g->last_on = looks && g->p.gates != 0 ? g->us : g->last_on;
        if (compares) {
            put(g, PWM_COMPARE_C, get(g, PWM_COMPARE_C));
        }
        if (slow) {
            prove(g, SLOW_KEY, 0);
        }
        if (thread) {
            prove(g, THREAD_KEY, THREADS_TURN);
        }
        behind++;
    }
    bench_run(&g->p, behind * 1e-6);
}

static void begin(struct program *g)
{
    static const uint32_t apart[3] = {2600, 2500, 2400};
    struct plant_params params = bench_plant();
    bench_start(&g->p, &params, apart);
    g->loop = g->slow = g->thread = true;
    g->us = 0;
    run(g, LIVES_US, false);
    check_hex("not started, nothing is watched", get(g, GATE_STATUS), LIVE);
    put(g, WATCH_TIME, CLOCKS);
    check_hex("it does not start while the bridge is on", get(g, WATCH_TIME), 0);
    put(g, GATE_CONTROL, 0);
    put(g, WATCH_TIME, CLOCKS);
    put(g, WATCH_TIME, 2 * CLOCKS);
    check_hex("it starts once, and keeps its time", get(g, WATCH_TIME), STARTED | CLOCKS);
    g->thread = false;
    run(g, LIVES_US, false);
    check_hex("nothing is missed while the bridge is off", get(g, GATE_STATUS), 0);
    g->thread = true;
    put(g, GATE_CONTROL, 1);
    run(g, LIVES_US, false);
    check_hex("a program that lives keeps the bridge on", get(g, GATE_STATUS), LIVE);
}

/* Runs on to some instant, stops these parts, and looks when the last gate was on. */
static void hang(const char *what, bool loop, bool slow, bool thread, uint32_t latch, int most_us)
{
    for (int after_us = 0; after_us < 1300; after_us += 311) {
        struct program g;
        begin(&g);
        run(&g, after_us, false);
        g.loop = !loop;
        g.slow = !slow;
        g.thread = !thread;
        int since = g.us;
        run(&g, OVER_US, true);
        check_between(what, g.last_on - since, 0, most_us);
        check_hex("its latch", get(&g, GATE_STATUS), latch);
        put(&g, GATE_CONTROL, 1);
        check_hex("which ENABLE does not pass", get(&g, GATE_CONTROL), 0);
        g.loop = g.slow = g.thread = true;
        run(&g, OVER_US, false);
        put(&g, GATE_STATUS, latch);
        put(&g, GATE_CONTROL, 1);
        run(&g, LIVES_US, false);
        check_hex("cleared and enabled, it goes on", get(&g, GATE_STATUS), LIVE);
    }
}

/* A loop that repeats one write, or a context that plays the other's part. */
static void wrong_word(const char *what, uint32_t key, uint32_t number)
{
    struct program g;
    begin(&g);
    while (get(&g, WATCH) & THREADS_TURN) {
        run(&g, 1, false);
    }
    put(&g, PROOF, key | ((get(&g, WATCH) + number) & 0xFF));
    check_hex(what, get(&g, GATE_STATUS), SLOW_LOST);
    check_hex("and no gate is on", g.p.gates, 0);
}

static void repeated_word(void)
{
    struct program g;
    begin(&g);
    while (get(&g, WATCH) & THREADS_TURN) {
        run(&g, 1, false);
    }
    uint32_t word = SLOW_KEY | (get(&g, WATCH) & 0xFF);
    put(&g, PROOF, word);
    check_hex("the next word is right", get(&g, GATE_STATUS), LIVE);
    put(&g, PROOF, word);
    check_hex("and wrong when it is repeated", get(&g, GATE_STATUS), THREAD_LOST);
}

static void reset_ends_it(void)
{
    struct program g;
    begin(&g);
    plant_reset_fabric(&g.p);
    check_hex("a reset ends the watch", get(&g, WATCH_TIME), 0);
    check_hex("and begins the sequence anew", get(&g, WATCH), 0);
}

int main(void)
{
    hang("the current loop alone: off by the end of the period that it does not answer", true, false, false, LOOP_LOST,
         100);
    hang("the slow loop: off within 3.5 ms", false, true, false, SLOW_LOST, 3501);
    hang("the thread: a millisecond later", false, false, true, THREAD_LOST, 4501);
    wrong_word("a number that is not the next", SLOW_KEY, 1);
    wrong_word("the thread's word in the slow loop's turn", THREAD_KEY, 0);
    repeated_word();
    reset_ends_it();
    return check_end();
}

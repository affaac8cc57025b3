/* SPDX-License-Identifier: MIT */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <setjmp.h>
#include <string.h>

#include "firmware/drive/requests.h"
#include "firmware/system/idle.h"
#include "swarm.h"
#include "tests/unit/host/envm.h"

#define SAMPLES    20u /* of a millisecond */
#define ROUNDS     4   /* of the thread, in one */
#define SLOT_BYTES 8192u
#define PS_PER_MS  1000000000
/* What the library has, that has a name here, too. */
#define REAL(name) \
    ({ \
        static __typeof__(&(name)) real; \
        real = real != NULL ? real : (__typeof__(&(name)))dlsym(RTLD_NEXT, #name); \
    })

extern char host_said[65536], host_heard[4096];
extern uint32_t host_said_bytes, host_heard_bytes, host_heard_taken;
extern uint32_t host_primask, host_basepri;
extern void (*host_on_sleep)(void);
extern struct host_bench host_bench;

struct world world;
static struct slots slots[AXIS_COUNT];
static struct nvm_report loaded[AXIS_COUNT];
static struct thermal_memory heat[AXIS_COUNT];
static uint32_t depth;    /* calls of the thread's waiting within each other */
static enum owner speaks; /* whose turn of the thread it is */
static jmp_buf power_fails;
static bool in_thread;

static void slow_loop(uint32_t n)
{
    struct axis *const a = &world.axes[n];
    const bool thread = in_thread;
    in_thread = false;
    a->heartbeat += (uint32_t)world.skipped;
    drive_step(a);
    samples_look_at_gates();
    in_thread = thread;
}

/* The second axis' step comes half a millisecond behind the first's. */
static void interrupts(void)
{
    const uint32_t primask = host_primask, basepri = host_basepri;
    host_primask = host_basepri = 0u;
    for (uint32_t n = AXIS_COUNT; n > 0u; n--) {
        while (samples_taken * AXIS_COUNT < SAMPLES * (AXIS_COUNT - n + 1u)) {
            samples_take();
        }
        slow_loop(n - 1u);
    }
    world.skipped = 0;
    samples_taken -= samples_taken < SAMPLES ? samples_taken : SAMPLES;
    host_bench.now += PS_PER_MS;
    world.now_ms++;
    host_primask = primask;
    host_basepri = basepri;
}

static enum owner begin_turn(enum owner line)
{
    const enum owner before = speaks;
    judge_turn(before);
    speaks = line;
    return before;
}

static void end_turn(enum owner before)
{
    judge_turn(speaks);
    speaks = before;
}

/* The console serves the buses while it prints: they are told apart there, too. */
void modbus_poll(struct modbus *m)
{
    const enum owner before = begin_turn(OWNER_MODBUS);
    REAL(modbus_poll)(m);
    end_turn(before);
}

void canopen_poll(struct canopen *c)
{
    const enum owner before = begin_turn(OWNER_CAN);
    REAL(canopen_poll)(c);
    end_turn(before);
}

static void poll_console(void)
{
    while (console_poll(&world.console)) {
    }
    host_said[host_said_bytes] = '\0';
    if (host_said_bytes != 0u) {
        judge_answer(host_said);
    }
    host_said_bytes = host_heard_bytes = host_heard_taken = 0u;
}

static void serve_axes(void)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        struct axis *const a = &world.axes[n];
        idle_serve_watchdog(NULL);
        drive_retry(a);
        drive_learn(a);
        drive_restore_cogging(a);
        identify_evaluate(&a->identify);
        for (int k = 0; k < ROUNDS && drive_prepare(a); k++) {
        }
    }
}

/* As main() does it. */
static void thread(void)
{
    in_thread = true;
    (void)begin_turn(OWNER_CONSOLE);
    poll_console();
    end_turn(OWNER_NONE);
    modbus_poll(&world.modbus);
    canopen_poll(&world.canopen);
    serve_axes();
    judge_turn(OWNER_NONE);
    in_thread = false;
}

/* ---- a millisecond ---- */

void world_millisecond(void)
{
    if (!world.powered) {
        for (uint32_t n = 0; n < SAMPLES * AXIS_COUNT; n++) {
            struct fabric dark = {.encoder.COUNTS = 0};
            plant_period(&world.plants[n % AXIS_COUNT], &dark);
        }
        world.now_ms++;
        return;
    }
    if (setjmp(power_fails) != 0) {
        world_power(false);
        return;
    }
    interrupts();
    if (world.hung_ms > 0) {
        world.hung_ms--;
        return;
    }
    thread();
    lines_deliver();
}

/* ---- the thread waits ---- */

void idle_serve_watchdog(struct idle *i)
{
    (void)i;
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        world.axes[n].thread_ms = world.axes[n].time_ms;
    }
}

void idle(struct idle *i)
{
    idle_serve_watchdog(i);
    interrupts();
}

bool request_settled(const struct axis *a)
{
    if (a->request != AXIS_REQUEST_NONE && in_thread && depth == 0u) {
        depth++;
        interrupts();
        depth--;
    }
    return a->request == AXIS_REQUEST_NONE;
}

bool encoder_init(struct encoder_regs *e, uint32_t counts, bool reverse)
{
    const bool done = REAL(encoder_init)(e, counts, reverse);
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        if (e == &world.fabrics[n].encoder) {
            plant_encoder_begins(&world.plants[n], &world.fabrics[n]);
        }
    }
    return done;
}

/* ---- power ---- */

static void boot(void)
{
    static struct mmuart uart;
    static struct idle rest;
    static const struct postmortem no_life;
    memset(world.fabrics, 0, sizeof world.fabrics);
    memset(world.axes, 0, sizeof world.axes);
    memset(heat, 0, sizeof heat);
    host_primask = host_basepri = 0u;
    host_bench.axis = &world.axes[0];
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        *(volatile uint32_t *)(uintptr_t)&world.fabrics[n].gate.ID = GATE_ID;
        drive_init(&world.axes[n], &world.fabrics[n]);
        drive_restore_temperatures(&world.axes[n], &heat[n]);
    }
#if AXIS_COUNT == 2u
    drive_link(&world.axes[0], &world.axes[1]);
#endif
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        drive_start(&world.axes[n], FAULT_NONE);
        world.axes[n].loop.handlers = samples_handlers(n);
    }
    modbus_start(&world.modbus, &lines_rs485, world.axes, slots);
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        drive_load_at_boot(&world.axes[n], &slots[n], &loaded[n]);
    }
    canopen_start(&world.canopen, &lines_can, world.axes, slots);
    rest.time_ms = &world.axes[0].time_ms;
    console_start(&world.console,
                  &(struct session){.out = {.uart = &uart, .idle = &rest, .bus = &world.modbus, .can = &world.canopen},
                                    .axes = world.axes,
                                    .axis = &world.axes[0],
                                    .last_run = &no_life,
                                    .slots = slots,
                                    .loaded = loaded});
    host_said_bytes = 0u;
}

void world_power(bool on)
{
    if (world.powered && !on) {
        envm_power_cut(&host_bench.envm, host_bench.now);
    }
    world.powered = false;
    world.flash_cut = 0;
    world.hung_ms = 0;
    depth = samples_taken = 0u;
    in_thread = false;
    lines_reset();
    if (on) {
        boot(); /* its greeting serves the buses, and nobody is there yet to judge that */
        world.powered = true;
    }
}

void host_envm_write(uintptr_t address, uint32_t value)
{
    REAL(host_envm_write)(address, value);
    if (world.flash_cut != 0 && --world.flash_cut == 0) {
        const struct envm *const e = &host_bench.envm;
        host_bench.now += envm_is_busy(e) ? (e->until - host_bench.now) / 3 : 0;
        longjmp(power_fails, 1);
    }
}

void world_new(bool (*commission)(struct axis *))
{
    memset(&world, 0, sizeof world);
    host_envm_new(&world.axes[0], 8e-3, 1);
    host_on_sleep = interrupts;
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        slots[n] = host_slots();
        slots[n].offset_bytes -= n * SLOT_BYTES;
        slots[n].memory = host_bench.envm.array + slots[n].offset_bytes;
        plant_init(&world.plants[n]);
    }
    world_power(true);
    for (uint32_t ms = 0; ms < 20u; ms++) {
        interrupts();
    }
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        struct saved unused;
        if (!commission(&world.axes[n]) || drive_save(&world.axes[n], &slots[n], &unused).error != ERROR_NONE) {
            __builtin_trap();
        }
    }
    world_power(false);
    world_power(true);
    world.now_ms = 0u;
}

/* ---- the only places that know the axis' own fields ---- */

bool world_is_live(uint32_t axis)
{
    return (world.fabrics[axis].gate.STATUS & GATE_STATUS_LIVE) != 0u;
}

bool world_operates(uint32_t axis)
{
    return world.axes[axis].state == AXIS_OPERATION_ENABLED;
}

bool world_wants(uint32_t axis)
{
    const struct axis *const a = &world.axes[axis];
    const uint32_t request = a->request, state = a->state;
    return a->switching.under_way || a->retry.wanted || request == AXIS_REQUEST_ON ||
           request == AXIS_REQUEST_IDENTIFY || request == AXIS_REQUEST_LEARN_HALL || state == AXIS_READY ||
           state == AXIS_SWITCHED_ON || state == AXIS_OPERATION_ENABLED;
}

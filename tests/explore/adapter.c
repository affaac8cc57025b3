/* SPDX-License-Identifier: MIT */
/* The drive and what surrounds it, its control state, and what must hold in each: the other half is events.c. */
#include "adapter.h"

#include <stdio.h>
#include <string.h>

#include "firmware/drive/start.h"
#include "firmware/drive/states.h"
#include "judge.h"
#include "world.h"

extern uint32_t host_primask, host_basepri;

#define SET(reg, value) (*(volatile uint32_t *)(uintptr_t) & (reg) = (uint32_t)(value))
#define ENOUGH_Q15      13670 /* 24 V */
#define TOO_LOW_Q15     5000
#define COUNTS_PER_MS   200u /* 2930 rpm of the encoder's 4096 counts */
#define OFF_WITHIN_MS   8

struct world world;
void *const explore_memory = &world;
const size_t explore_bytes = sizeof world;
const char *explore_wrong;

static struct axis *const a = &world.axis;
static bool judges, steps; /* no interrupt comes while the explorer looks, no slow loop in a slow loop */

void world_wrong(const char *what)
{
    explore_wrong = explore_wrong != NULL ? explore_wrong : what;
}

/* ---- what surrounds the drive ---- */

/* LIVE follows ENABLE, which a latch clears; docs/fabric.md, slot 3. */
void world_hardware(void)
{
    struct fabric *const f = &world.fabric;
    const uint32_t latches = f->gate.STATUS & GATE_STATUS_LATCHES;
    f->gate.CONTROL = latches != 0u ? 0u : f->gate.CONTROL;
    const bool live = f->gate.CONTROL != 0u || world.stuck;
    const bool lost = (f->encoder.STATUS & (ENCODER_STATUS_ILLEGAL | ENCODER_STATUS_SIGNAL_LOST)) != 0u;
    const bool limit = (f->adc.STATUS & (ADC_STATUS_CURRENT | ADC_STATUS_VBUS_LOW)) != 0u;
    f->gate.STATUS =
        latches | (live ? GATE_STATUS_LIVE : 0u) | (lost ? GATE_STATUS_ENCODER : 0u) | (limit ? GATE_STATUS_LIMIT : 0u);
}

static void pass_millisecond(void)
{
    struct fabric *const f = &world.fabric;
    const uint32_t samples = (uint32_t)a->loop.loops_per_slow;
    const uint32_t turn = (uint32_t)a->tuning.encoder_counts;
    world.position += world.turns ? COUNTS_PER_MS : 0u;
    SET(f->adc.SEQUENCE, f->adc.SEQUENCE + samples);
    SET(f->adc.VBUS, world.low ? TOO_LOW_Q15 : ENOUGH_Q15);
    SET(f->encoder.LATCH_TIME, f->encoder.LATCH_TIME + samples * (uint32_t)a->tuning.loop_counts);
    SET(f->encoder.LATCHED, world.position % (turn == 0u ? 4096u : turn));
    if (world.turns) {
        SET(f->encoder.EDGE_TIME, f->encoder.LATCH_TIME - 100u);
    }
    a->loop.pll.speed_q32 = world.turns ? (int32_t)(COUNTS_PER_MS * a->loop.encoder_scale_q32 / samples) : 0;
    a->loop.pll.angle_q32 += samples * (uint32_t)a->loop.pll.speed_q32;
    f->adc.STATUS = world.low ? ADC_STATUS_VBUS_LOW : 0u;
}

/* As the interrupt's handlers end: control/current_loop_step.h. */
static void current_loop_looks(void)
{
    const uint32_t ignored = a->loop.source == LOOP_ENCODER || a->loop.source == LOOP_FORCED ? 0u : GATE_STATUS_ENCODER;
    world_hardware();
    if ((world.fabric.gate.STATUS & ~ignored) > a->loop.status_max) {
        drive_sample_fault(a);
    }
    world_hardware();
}

static void forget_measuring(void)
{
    const bool ended =
        (a->state == AXIS_SWITCH_ON_DISABLED && a->request == AXIS_REQUEST_NONE) || a->faults.cause != 0u;
    world.wish = world.wish == WISH_MEASURING && ended ? WISH_NONE : world.wish;
}

/* As canopen_nmt.c tells it: a loss only to whom this bus commands. */
static void tell_loss(void)
{
    world.gone = world.gone && a->owner.who == OWNER_CAN;
    a->master_lost = world.gone ? 1u : 0u;
}

void world_step(void)
{
    steps = true;
    pass_millisecond();
    current_loop_looks();
    world.cleared = world.cleared || a->request == AXIS_REQUEST_CLEAR;
    const bool starts = a->state == AXIS_SWITCHED_ON;
    drive_step(a);
    const bool moves = a->set_point.waits || a->speed.target_rpm_q16 != a->retry.start_rpm_q16;
    if (starts && a->state == AXIS_OPERATION_ENABLED && moves) {
        world_wrong("operation begins with a set-point from before");
    }
    world_hardware();
    forget_measuring();
    steps = false;
}

/* As main() does it. */
void world_round(void)
{
    cia402_poll(&world.bus, a);
    tell_loss();
    /* who is lost, and nothing turns that he would have to stop, has no wish any more */
    world.wish = owner_is_lost(a) && !drive_is_on(a) && a->request == AXIS_REQUEST_NONE ? WISH_NONE : world.wish;
    drive_retry(a);
    drive_learn(a);
    drive_restore_cogging(a);
    identify_evaluate(&a->identify);
    while (drive_prepare(a) && a->switching.under_way && a->switching.built) {
        a->time_ms++; /* to the pace of starts: no state of its own */
    }
    world_hardware();
}

/* ---- setups ---- */

enum { BY_ENCODER, SENSORLESS, HALL };

static const struct {
    uint8_t source;
    bool kind; /* the gentlest reaction that each fault allows */
    uint8_t retries;
    int32_t injection_mv;
} ways[] = {
    {BY_ENCODER, false, 1, 0}, {BY_ENCODER, true, 1, 0},  {SENSORLESS, true, 1, 0},  {SENSORLESS, true, 1, 2000},
    {HALL, true, 1, 0},        {BY_ENCODER, false, 1, 0}, {BY_ENCODER, false, 1, 0}, {BY_ENCODER, true, 0, 0},
    {BY_ENCODER, false, 1, 0}, {HALL, true, 0, 0},        {BY_ENCODER, false, 1, 0},
};

const struct explore_setup explore_setups[] = {
    {"encoder", BASE | FAULTS | SUPPLY | GATE | REPORTS | STARTS | RETRIES | OWNERS_CHANGE, true},
    {"encoder-kind", BASE | FAULTS | SUPPLY | REPORTS | TURNS, false},
    {"sensorless", BASE | FAULTS | SUPPLY | GATE | REPORTS | TURNS | STARTS | PARAMS, false},
    {"injection", BASE | FAULTS | SUPPLY | REPORTS | TURNS | STARTS, false},
    {"Hall", BASE | FAULTS | REPORTS | TURNS | STARTS | SOURCES, false},
    {"bus", BASE | FAULTS | SUPPLY | BUS, false},
    {"bus-set-points", BASE | BUS | BUS_MODES | REPORTS, false},
    {"set-points", BASE | REPORTS | MODES | PARAMS | TURNS | STARTS, false},
    {"measuring", BASE | FAULTS | STARTS | MEASURE, true},
    {"learn-hall", BASE | FAULTS | STARTS | MEASURE, true},
    {"bus-owners", BASE | BUS | BUS_OWNERS, false},
};
const int explore_setup_count = sizeof explore_setups / sizeof explore_setups[0];

static void choose(bool kind)
{
    for (uint32_t cause = 0; cause < FAULT_COUNT; cause++) {
        const uint32_t allowed = fault_class((enum fault)cause)->allowed;
        for (uint32_t choice = 0; kind && choice < REACTION_COUNT; choice++) {
            a->reactions.choice[cause] = (allowed >> choice & 1u) != 0u ? (uint8_t)choice : a->reactions.choice[cause];
        }
    }
}

void explore_begin(int setup)
{
    memset(&world, 0, sizeof world);
    drive_init(a, &world.fabric);
    cia402_init(&world.bus, OWNER_CAN);
    SET(world.fabric.gate.ID, GATE_ID);
    SET(world.fabric.encoder.HALL, 1);
    world.fabric.adc.OFFSET_A = world.fabric.adc.OFFSET_B = world.fabric.adc.OFFSET_C = 32768;
    a->params.angle_source = ways[setup].source;
    a->params.retry_count = ways[setup].retries;
    a->params.injection_mv = ways[setup].injection_mv;
    a->params.retry_delay_ms = 10;
    a->params.stop_max_ms = 100;
    a->params.command_timeout_ms = 5000;
    a->params.low_side_shunts = 0;
    choose(ways[setup].kind);
    a->fabric_untrusted = 0;
    a->state = AXIS_SWITCH_ON_DISABLED;
    for (int ms = 0; ms < 20; ms++) {
        world_step();
    }
    world.shown_before = 0x40u;
    explore_wrong = NULL;
}

/* ---- the control state ---- */

/* Which of the classes of causes that the state machine tells apart. */
static uint32_t class_of_cause(uint32_t cause)
{
    const bool spoils = cause == FAULT_ENCODER || cause == FAULT_ENCODER_SLIP || cause == FAULT_ENCODER_DEAD ||
                        cause == FAULT_ENCODER_COUNTS;
    return cause == FAULT_NONE ? 0u : 1u + (spoils ? 1u : 0u) + (fault_class((enum fault)cause)->retry ? 2u : 0u);
}

static uint32_t timer(bool runs, bool due)
{
    return runs ? 1u + (due ? 1u : 0u) : 0u;
}

#define PUT(value) key[n++] = (uint8_t)(value)

static size_t key_of_drive(uint8_t *key)
{
    const struct retry *const r = &a->retry;
    const bool on = a->state == AXIS_SWITCHED_ON,
               runs = a->state == AXIS_OPERATION_ENABLED || a->state == AXIS_QUICK_STOP;
    size_t n = 0;
    PUT(a->state);
    PUT(a->request);
    PUT(class_of_cause(a->faults.cause));
    PUT(world.fabric.gate.CONTROL | (world.fabric.gate.STATUS & GATE_STATUS_LATCHES ? 2u : 0u) |
        a->loop.locked_out << 2);
    PUT(current_loop_is_on(&a->loop));
    PUT(runs ? a->mode : 255u);
    PUT(on || runs ? a->loop.source | (a->loop.field_follows != 0u ? 16u : 0u) : 255u);
    PUT(a->set_point.waits ? (runs ? a->set_point.mode : 254u) : 255u);
    PUT(on ? a->start.phase : 255u);
    PUT(on && (a->start.phase == START_CATCH || a->start.phase == START_CHECK_TURNING) ? a->flying.regulates : 255u);
    PUT(a->start.aligned | a->start.index_known << 1 | a->start.wired << 2 | a->start.recheck_wiring << 3 |
        a->start.remembered << 4);
    PUT(on && a->start.learns);
    PUT(a->reactions.stopping | r->wanted << 1 | r->waiting << 2 | r->due << 3 | (r->resumes && r->wanted) << 4);
    PUT(r->count != 0u);
    PUT(timer(r->waiting, a->time_ms - r->latched_ms >= (uint32_t)a->params.retry_delay_ms));
    PUT(runs && a->speed.target_rpm_q16 != 0);
    PUT(timer(r->resumes && r->wanted, r->resume_rpm_q16 != 0));
    PUT(runs ? class_of_cause(a->failover.cause) : a->failover.cause != 0u);
    PUT(class_of_cause(a->failover.pending));
    PUT(a->tuning.angle_source);
    PUT(a->switching.under_way);
    PUT(a->handover.under_way | a->handover.asked << 1 | a->handover.offset_known << 2);
    PUT(a->handover.under_way ? a->handover.target : 0u);
    PUT(a->identify.running | a->identify.evaluating << 1 | a->identify.taken << 2);
    PUT(a->identify.running ? a->identify.step : 0u);
    PUT(a->mode == AXIS_MODE_LEARNING && runs ? a->motion.learn.phase : 0u);
    PUT(a->motion.homed);
    PUT(a->params.speed_max_rpm / 1000 | a->params.retry_count << 4);
    PUT(q15_abs(a->speed.speed_rpm_q4) > AXIS_STANDSTILL_RPM_Q4);
    PUT(a->loop.vbus_q15 < a->tuning.v_min_q15);
    return n;
}

size_t explore_key(uint8_t *key)
{
    const struct cia402 *const c = &world.bus;
    size_t n = key_of_drive(key);
    PUT(c->stage | c->word_due << 2 | c->target_due << 3 | c->authority << 4 | c->source_due << 6 |
        (c->faults != a->faults.count) << 7);
    PUT(a->owner.who | world.gone << 2 | (a->owner.who != OWNER_NONE && supervision_is_silent(a)) << 3);
    PUT(c->word_before);
    PUT(c->word_before >> 8);
    PUT(c->setpoints.mode);
    PUT(c->setpoints.target_rpm != 0);
    PUT(world.low | world.turns << 1 | world.stuck << 2);
    PUT(world.wish);
    return n;
}

static const char *const state_names[] = {"not ready",
                                          "switch on disabled",
                                          "ready",
                                          "switched on",
                                          "operation enabled",
                                          "quick stop",
                                          "fault reaction",
                                          "fault",
                                          "calibration",
                                          "wiring",
                                          "alignment",
                                          "to the rotor's frame",
                                          "field",
                                          "identify",
                                          "catch",
                                          "doubt",
                                          "injection",
                                          "Hall",
                                          "learn hall: field",
                                          "learn hall: turn",
                                          "offset check",
                                          "speed",
                                          "torque",
                                          "position",
                                          "homing",
                                          "cyclic position",
                                          "cyclic speed",
                                          "cyclic torque",
                                          "learn cogging",
                                          "carries on"};
#define PHASES   8
#define MODES_AT 21
const int explore_place_count = sizeof state_names / sizeof state_names[0];

int explore_place(void)
{
    if (a->state == AXIS_SWITCHED_ON) {
        return PHASES + (int)a->start.phase;
    }
    if (a->state != AXIS_OPERATION_ENABLED) {
        return (int)a->state;
    }
    return a->failover.cause != 0u || a->failover.pending != 0u ? explore_place_count - 1 : MODES_AT + (int)a->mode;
}

const char *explore_place_name(int place)
{
    return state_names[place];
}

const char *explore_show(void)
{
    static char text[80];
    snprintf(text, sizeof text, "cause %u, gates %u, wish %u, request %u, shown 0x%02X ", (unsigned)a->faults.cause,
             (unsigned)world.fabric.gate.CONTROL, (unsigned)world.wish, (unsigned)a->request,
             (unsigned)judge_state_shown(&world.bus, a));
    return text;
}

/* ---- what must hold ---- */

void explore_judge_shown(void)
{
    judges = true;
    const char *const jump = judge_shown(&world.shown_before, &world.bus, a);
    if (jump != NULL) {
        world_wrong(jump);
    }
    judges = false;
}

void explore_judge(void)
{
    judges = true;
    const char *const wrong = judge_axis(a, world.fabric.gate.CONTROL != 0u);
    const uint32_t cause = a->faults.cause;
    if (wrong != NULL) {
        world_wrong(wrong);
    }
    if (world.cause_before != FAULT_NONE && cause != world.cause_before && !world.cleared) {
        world_wrong("the first cause did not stay");
    }
    const bool starts = a->state == AXIS_READY || a->state == AXIS_SWITCHED_ON;
    if (world.wish == WISH_NONE && starts && a->request == AXIS_REQUEST_NONE && cause == FAULT_NONE) {
        world_wrong("it starts without a wish");
        world.wish = WISH_OPERATION; /* once is enough: what follows from it is no other finding */
    }
    const bool goes_on = drive_is_on(a) && a->state != AXIS_QUICK_STOP && a->request == AXIS_REQUEST_NONE;
    if (goes_on && a->owner.who == OWNER_NONE && cause == FAULT_NONE) {
        world_wrong("it is on and nobody commands it");
    }
    explore_judge_shown();
    world.cause_before = cause;
    world.cleared = false;
    judges = false;
}

const volatile uint32_t *const explore_watched[2] = {&world.fabric.gate.CONTROL, &world.gates_before};

void explore_look(void)
{
    const uint32_t now = world.fabric.gate.CONTROL;
    world_hardware();
    /* a quick stop may brake: gates that an over-current has shut for a moment, on a wrong angle, open again for it */
    const bool brakes = a->request == AXIS_REQUEST_QUICK_STOP && a->state == AXIS_OPERATION_ENABLED;
    if (now != 0u && world.wish == WISH_NONE && !brakes) {
        world_wrong("the gates open without a wish");
        world.wish = WISH_OPERATION;
    }
    if (now != 0u && a->faults.cause != FAULT_NONE) {
        world_wrong("the gates open while a fault is latched");
    }
    world.gates_before = now;
}

static bool rests(void)
{
    const uint32_t state = a->state;
    const bool off =
        state == AXIS_SWITCH_ON_DISABLED || state == AXIS_FAULT || (state == AXIS_FAULT_REACTION && world.stuck);
    return off && world.fabric.gate.CONTROL == 0u;
}

/* At once, and it stays so, whatever timers were running. */
void explore_judge_off(int unused)
{
    (void)unused;
    (void)drive_switch_off(a);
    world.wish = WISH_NONE;
    for (int ms = 0; ms < OFF_WITHIN_MS && !rests(); ms++) {
        world_step();
        world_round();
    }
    if (!rests()) {
        world_wrong("'off' does not lead to rest");
        return;
    }
    a->time_ms += 20000u;
    for (int ms = 0; ms < 2 * OFF_WITHIN_MS; ms++) {
        world_step();
        world_round();
        if (world.fabric.gate.CONTROL != 0u || !(rests() || a->state == AXIS_FAULT_REACTION)) {
            world_wrong("after 'off' it does not stay at rest");
        }
    }
}

/* ---- interrupts ---- */

const char *const explore_interrupt_names[] = {"none",          "over-current", "encoder", "STO",
                                               "under-voltage", "gate driver",  "ECC",     NULL};

static void end_sample(void)
{
    world.fabric.adc.STATUS &= ~ADC_STATUS_CURRENT;
    world.fabric.adc.STATUS &= world.low ? UINT32_MAX : ~ADC_STATUS_VBUS_LOW;
}

bool explore_interrupt(int kind)
{
    struct fabric *const f = &world.fabric;
    static const uint32_t sampled[] = {0, ADC_STATUS_CURRENT, 0, 0, ADC_STATUS_VBUS_LOW, 0, 0};
    static const uint32_t latched[] = {0, 0, 0, GATE_STATUS_STO_A, 0, GATE_STATUS_DRIVER_FAULT, 0};
    if (kind < 0 || kind >= (int)(sizeof sampled / sizeof sampled[0])) {
        return false;
    }
    f->adc.STATUS |= sampled[kind];
    f->gate.STATUS |= latched[kind];
    f->encoder.STATUS |= kind == 2 ? ENCODER_STATUS_ILLEGAL : 0u;
    if (kind == 6) {
        fault_raise(a, FAULT_ECC); /* an interrupt of its own: it comes whether the current loop is on or not */
    }
    current_loop_looks();
    end_sample();
    return true;
}

bool explore_slow_loop(void)
{
    world_step();
    return true;
}

void explore_settle(void)
{
    for (int ms = 0; ms < 2; ms++) {
        world_step();
        explore_judge();
        world_round();
        explore_judge();
    }
}

bool explore_request_waits(void)
{
    return a->request != AXIS_REQUEST_NONE;
}

bool explore_masks_all(void)
{
    return judges || host_primask != 0u;
}

bool explore_masks_slow_loop(void)
{
    return judges || steps || host_primask != 0u || host_basepri != 0u;
}

/* SPDX-License-Identifier: MIT */
/* What can happen to the drive. */
#include <string.h>

#include "adapter.h"
#include "world.h"

#define WAIT_MS 300
#define LONG_MS 20000u

static struct axis *const a = &world.axis;

/* ---- time ---- */

static void step(int32_t forced)
{
    world.forced = (uint32_t)forced;
    world_step();
    world.forced = AS_IT_DOES;
}

static bool forces(int32_t forced)
{
    const bool searches = a->state == AXIS_OPERATION_ENABLED && (a->mode == AXIS_MODE_HOMING);
    return forced == AS_IT_DOES || a->state == AXIS_SWITCHED_ON || searches;
}

static void round_once(int32_t unused)
{
    (void)unused;
    world_round();
}

/* Again and again, until the control state is another. */
static void repeat(void (*act)(void))
{
    uint8_t before[KEY_MOST], now[KEY_MOST];
    const size_t length = explore_key(before);
    for (int ms = 0; ms < WAIT_MS && explore_wrong == NULL; ms++) {
        act();
        (void)explore_key(now);
        if (memcmp(before, now, length) != 0) {
            return;
        }
        explore_judge();
    }
}

static void wait(int32_t unused)
{
    (void)unused;
    repeat(world_step);
}

static void rounds(int32_t unused)
{
    (void)unused;
    repeat(world_round);
}

static void long_time(int32_t unused)
{
    (void)unused;
    a->time_ms += LONG_MS;
    world_step();
}

static void heard(int32_t unused)
{
    (void)unused;
    a->time_ms += LONG_MS;
    owner_message(a, (enum owner)a->owner.who);
    world_step();
}

static void late(int32_t unused)
{
    (void)unused;
    a->heartbeat += 7u; /* as if so many had not come */
    world_step();
}

/* ---- the operator ---- */

/* As a line of the console does it: what the bus commands is not its own to begin. */
static void begin(struct outcome (*ask)(struct axis *), enum wish wish)
{
    const uint32_t before = world.wish;
    if (owner_allows(a, OWNER_CONSOLE).error != ERROR_NONE) {
        return;
    }
    world.wish = wish;
    if (ask(a).error == ERROR_NONE) {
        owner_take(a, OWNER_CONSOLE);
        world.wish = wish; /* a step before the request has been taken for the end of it */
    } else {
        world.wish = before;
    }
}

static void on(int32_t unused)
{
    (void)unused;
    begin(drive_switch_on, WISH_OPERATION);
}

static void off(int32_t unused)
{
    (void)unused;
    owner_stopped(a, OWNER_CONSOLE);
    (void)drive_switch_off(a);
    world.wish = WISH_NONE;
}

static void quick_stop(int32_t unused)
{
    (void)unused;
    (void)drive_quick_stop(a);
    world.wish = WISH_NONE;
}

/* Refused while nothing is latched, it is no word on what is under way. */
static void clear(int32_t unused)
{
    (void)unused;
    const bool faulty = a->state == AXIS_FAULT || a->state == AXIS_FAULT_REACTION;
    const struct outcome outcome = drive_clear_fault(a);
    world.wish = faulty || outcome.error == ERROR_NONE ? WISH_NONE : world.wish;
}

/* What goes on goes on; but a restart is the former owner's wish. */
static void take_over(int32_t who)
{
    const bool waits = a->owner.who != (uint32_t)who && a->faults.cause != FAULT_NONE;
    if (who == OWNER_CAN) {
        cia402_take_over(&world.bus, a);
    } else {
        owner_take(a, (enum owner)who);
    }
    world.wish = waits ? WISH_NONE : world.wish;
}

static bool has_owner(int32_t who)
{
    return a->owner.who != OWNER_NONE && a->owner.who != (uint32_t)who;
}

static void lose_master(int32_t unused)
{
    (void)unused;
    world.gone = true;
    a->master_lost = 1u;
    world_step();
}

static bool bus_commands(int32_t unused)
{
    (void)unused;
    return a->owner.who == OWNER_CAN;
}

static void identify(int32_t unused)
{
    (void)unused;
    begin(drive_identify, WISH_MEASURING);
}

static void learn_hall(int32_t unused)
{
    (void)unused;
    begin(drive_learn_hall, WISH_MEASURING);
}

static void use_identified(int32_t unused)
{
    (void)unused;
    const struct params before = a->params;
    (void)drive_identify_use(a);
    a->params = before; /* other values would be another setup */
}

static void source(int32_t target)
{
    (void)drive_change_source(a, (uint32_t)target);
}

/* The look has seen a turn, and this in it. */
static void look_ends(int32_t apart_q32)
{
    struct handover *const h = &a->handover;
    h->samples = 1000;
    h->travel_q32 = 1LL << 33;
    h->apart_q32 = apart_q32;
    h->states = 0x7Eu; /* all of the switches', and more than the EMF needs */
    world_round();
}

static bool looks(int32_t unused)
{
    (void)unused;
    return a->handover.under_way && !a->handover.asked;
}

static bool may_set(int32_t unused)
{
    (void)unused;
    return a->request == AXIS_REQUEST_NONE && drive_is_off(a);
}

static void limit_speed(int32_t rpm)
{
    a->params.speed_max_rpm = rpm;
}

static void allow_retries(int32_t count)
{
    a->params.retry_count = count;
}

/* ---- set-points ---- */

struct aim {
    uint32_t mode, next_mode;
    int64_t target, next_target;
    bool waits;
};

static struct aim aim_now(void)
{
    const struct set_point *const next = &a->set_point;
    return (struct aim){a->mode, next->mode, a->speed.target_rpm_q16, next->value, next->waits};
}

static struct outcome relative(struct axis *axis, int32_t counts)
{
    return drive_command_position(axis, counts, true);
}

static struct outcome absolute(struct axis *axis, int32_t counts)
{
    return drive_command_position(axis, counts, false);
}

static struct outcome home(struct axis *axis, int32_t method)
{
    return drive_command_home(axis, (enum homing_method)method);
}

static struct outcome learn_cogging(struct axis *axis, int32_t unused)
{
    (void)unused;
    return drive_learn_cogging(axis);
}

static struct outcome zero(struct axis *axis, int32_t unused)
{
    (void)unused;
    return drive_set_zero(axis);
}

static void command(struct outcome (*give)(struct axis *, int32_t), int32_t value, bool forbidden)
{
    if (owner_allows(a, OWNER_CONSOLE).error != ERROR_NONE) {
        return;
    }
    const struct aim before = aim_now();
    const uint32_t before_ms = a->time_ms; /* what the slow loop does meanwhile is no matter of this one */
    const struct outcome outcome = give(a, value);
    const struct aim now = aim_now();
    const bool same = before.mode == now.mode && before.target == now.target && before.next_mode == now.next_mode &&
                      before.next_target == now.next_target && before.waits == now.waits;
    if (outcome.error != ERROR_NONE && !same && a->time_ms == before_ms) {
        world_wrong("a refused set-point has changed something");
    }
    if (outcome.error == ERROR_NONE && forbidden) {
        world_wrong("a set-point beyond its limit is accepted");
    }
}

#define SPEED_MOST 4000
#define SET_POINT(name, give, limit) \
    static void name(int32_t value) \
    { \
        command(give, value, value > (limit) || value < -(limit)); \
    }

SET_POINT(speed, drive_command_speed, a->params.speed_max_rpm)
SET_POINT(current, drive_command_current, a->params.i_max_ma)
SET_POINT(cyclic_speed, drive_command_cyclic_speed, a->params.speed_max_rpm)
SET_POINT(cyclic_current, drive_command_cyclic_current, a->params.i_max_ma)
SET_POINT(cyclic_position, drive_command_cyclic_position, 1000000)
SET_POINT(go_to, absolute, INT32_MAX)
SET_POINT(go_by, relative, INT32_MAX)
SET_POINT(go_home, home, INT32_MAX)
SET_POINT(cogging, learn_cogging, INT32_MAX)
SET_POINT(set_zero, zero, INT32_MAX)

/* ---- the bus ---- */

#define ALL_ENABLE_BITS 0x0Fu

static void word(int32_t bits)
{
    struct cia402_setpoints w = world.bus.setpoints;
    const bool all = ((uint32_t)bits & ALL_ENABLE_BITS) == ALL_ENABLE_BITS;
    const bool ends = !all && (cia402_stops((uint32_t)bits) || a->owner.who == OWNER_CAN);
    w.control_word = (uint32_t)bits;
    cia402_accept(&world.bus, &w, true, false);
    world.wish = all ? WISH_OPERATION : world.wish;
    cia402_poll(&world.bus, a);
    world.wish = ends ? WISH_NONE : world.wish;
}

static void bus_mode(int32_t mode)
{
    struct cia402_setpoints w = world.bus.setpoints;
    w.mode = mode;
    w.target_rpm = w.target_rpm == 0 ? 3000 : 0;
    if (cia402_allows(&w, &a->params)) {
        cia402_accept(&world.bus, &w, false, true);
    }
    cia402_poll(&world.bus, a);
}

/* ---- faults ---- */

static void in_sample(int32_t kind)
{
    (void)explore_interrupt(kind);
}

static void latch_unseen(int32_t bits)
{
    world.fabric.gate.STATUS |= (uint32_t)bits;
    world_hardware();
}

static void report(int32_t cause)
{
    world.report = (uint32_t)cause;
    world_step();
    world.report = FAULT_NONE;
}

static void supply(int32_t low)
{
    world.low = low != 0;
    world_step();
}

static void rotor(int32_t turns)
{
    world.turns = turns != 0;
    world_step();
}

static void gate(int32_t stuck)
{
    world.stuck = stuck != 0;
    world_hardware();
}

static bool gate_may(int32_t stuck)
{
    return world.stuck != (stuck != 0) && (stuck == 0 || (world.fabric.gate.STATUS & GATE_STATUS_LIVE) != 0u);
}

const struct explore_event explore_events[] = {
    {"step", NULL, BASE, step, AS_IT_DOES, NULL},
    {"wait", NULL, BASE, wait, 0, NULL},
    {"thread", NULL, BASE, round_once, 0, NULL},
    {"thread, many times", NULL, BASE, rounds, 0, NULL},
    {"20 s", NULL, BASE, long_time, 0, NULL},
    {"20 s, its owner speaks", NULL, OWNERS_CHANGE, heard, 0, NULL},
    {"on", "on", BASE, on, 0, NULL},
    {"off", "off", BASE, off, 0, NULL},
    {"quick stop", "quickstop", BASE, quick_stop, 0, NULL},
    {"clear", "clear", BASE, clear, 0, NULL},
    {"phase ends well", NULL, BASE, step, WELL, forces},
    {"phase ends badly", NULL, STARTS, step, BADLY, forces},
    {"phase ends otherwise", NULL, STARTS, step, OTHERWISE, forces},
    {"phase ends worst", NULL, STARTS, step, WORST, forces},
    {"sample: over-current", NULL, FAULTS, in_sample, 1, NULL},
    {"sample: encoder", "=encoder_illegal []", FAULTS, in_sample, 2, NULL},
    {"sample: STO", "=sto [\"A\", \"1\"]", FAULTS, in_sample, 3, NULL},
    {"latch: STO, seen by the slow loop", NULL, FAULTS, latch_unseen, GATE_STATUS_STO_B, NULL},
    {"interrupt: ECC", NULL, FAULTS, in_sample, 6, NULL},
    {"slow loop finds the heartbeat gone", NULL, FAULTS, late, 0, NULL},
    {"supply low", "=supply_v [\"0.5 * vbus_V\"]", SUPPLY, supply, 1, NULL},
    {"supply back", "=supply_v [\"vbus_V\"]", SUPPLY, supply, 0, NULL},
    {"rotor turns", NULL, TURNS, rotor, 1, NULL},
    {"rotor stands", NULL, TURNS, rotor, 0, NULL},
    {"gate does not let go", NULL, GATE, gate, 1, gate_may},
    {"gate lets go", NULL, GATE, gate, 0, gate_may},
    {"report: stall", NULL, REPORTS, report, FAULT_STALL, world_has_sensor_for},
    {"report: over-temperature", NULL, REPORTS, report, FAULT_OVERTEMPERATURE, world_has_sensor_for},
    {"report: following error", NULL, REPORTS, report, FAULT_FOLLOWING_ERROR, world_has_sensor_for},
    {"report: encoder slip", NULL, REPORTS, report, FAULT_ENCODER_SLIP, world_has_sensor_for},
    {"report: encoder counts", NULL, REPORTS, report, FAULT_ENCODER_COUNTS, world_has_sensor_for},
    {"report: Hall sequence", NULL, REPORTS, report, FAULT_HALL_SEQUENCE, world_has_sensor_for},
    {"report: lock lost", NULL, REPORTS, report, FAULT_LOCK_LOST, world_has_sensor_for},
    {"speed_max 1000", "set speed_max_rpm 1000", PARAMS, limit_speed, 1000, may_set},
    {"speed_max 4000", "set speed_max_rpm 4000", PARAMS, limit_speed, SPEED_MOST, may_set},
    {"no retry", "set retry_count 0", RETRIES, allow_retries, 0, may_set},
    {"one retry", "set retry_count 1", RETRIES, allow_retries, 1, may_set},
    {"speed 3000", "speed 3000", MODES | TURNS | PARAMS, speed, 3000, NULL},
    {"speed -3000", "speed -3000", MODES, speed, -3000, NULL},
    {"speed 4001", "speed 4001", MODES, speed, SPEED_MOST + 1, NULL},
    {"torque 1", "torque 1", MODES, current, 1000, NULL},
    {"torque beyond", "torque 1000", MODES, current, INT32_MAX, NULL},
    {"position 4000", "pp 4000", MODES, go_to, 4000, NULL},
    {"position by -4000", "pp by -4000", MODES, go_by, -4000, NULL},
    {"home index", "hm index", MODES, go_home, HOMING_INDEX, NULL},
    {"home block", "hm block", MODES, go_home, HOMING_BLOCK, NULL},
    {"cyclic position", "csp 0", MODES, cyclic_position, 0, NULL},
    {"cyclic position beyond", NULL, MODES, cyclic_position, INT32_MAX, NULL},
    {"cyclic speed", "csv 500", MODES, cyclic_speed, 500, NULL},
    {"cyclic speed beyond", NULL, MODES, cyclic_speed, INT32_MIN, NULL},
    {"cyclic current", "cst 0.5", MODES, cyclic_current, 500, NULL},
    {"cyclic current beyond", NULL, MODES, cyclic_current, INT32_MIN, NULL},
    {"zero", "zero", MODES, set_zero, 0, NULL},
    {"learn cogging", "learn cogging", MODES, cogging, 0, NULL},
    {"source encoder", "angle encoder", SOURCES, source, PARAM_ANGLE_ENCODER, NULL},
    {"source sensorless", "angle observer", SOURCES, source, PARAM_ANGLE_SENSORLESS, NULL},
    {"source hall", "angle hall", SOURCES, source, PARAM_ANGLE_HALL, NULL},
    {"look agrees", NULL, SOURCES, look_ends, 0, looks},
    {"look disagrees", NULL, SOURCES, look_ends, INT32_MAX, looks},
    {"identify", "identify", MEASURE, identify, 0, NULL},
    {"identify use", "identify use", MEASURE, use_identified, 0, may_set},
    {"learn hall", "learn hall", MEASURE, learn_hall, 0, NULL},
    {"console takes over", "take", BUS_OWNERS | OWNERS_CHANGE, take_over, OWNER_CONSOLE, has_owner},
    {"Modbus takes over", NULL, OWNERS_CHANGE, take_over, OWNER_MODBUS, has_owner},
    {"CAN takes over", NULL, BUS_OWNERS, take_over, OWNER_CAN, has_owner},
    {"the bus loses its master", NULL, BUS_OWNERS, lose_master, 0, bus_commands},
    {"word 0x00", NULL, BUS, word, 0x00, NULL},
    {"word 0x02 quick stop", NULL, BUS, word, 0x02, NULL},
    {"word 0x06 shutdown", NULL, BUS, word, 0x06, NULL},
    {"word 0x07 switch on", NULL, BUS, word, 0x07, NULL},
    {"word 0x0F enable", NULL, BUS, word, 0x0F, NULL},
    {"word 0x8F reset and enable", NULL, BUS, word, 0x8F, NULL},
    {"word 0x80 reset", NULL, BUS, word, 0x80, NULL},
    {"word 0x10F halt", NULL, BUS_MODES, word, 0x10F, NULL},
    {"word 0x1F set-point", NULL, BUS_MODES, word, 0x1F, NULL},
    {"bus: mode pv", NULL, BUS_MODES, bus_mode, CIA402_PV, NULL},
    {"bus: mode pp", NULL, BUS_MODES, bus_mode, CIA402_PP, NULL},
};
const int explore_event_count = sizeof explore_events / sizeof explore_events[0];

bool explore_is_slow_loop(int event)
{
    return explore_events[event].act == step;
}

bool explore_is_thread(int event)
{
    return explore_events[event].act == round_once;
}

bool explore_is_request(int event)
{
    const char *const played = explore_events[event].played;
    return (played != NULL && played[0] != '=') || (explore_events[event].groups & (BUS | BUS_MODES)) != 0u;
}

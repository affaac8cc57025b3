/* SPDX-License-Identifier: MIT */
/* What must never be, by plant and gates. */
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "swarm.h"
#include "tests/explore/judge.h"

#define HULL_RPM_MS   3.0 /* slower than the ramp */
#define HOLD_MS       300u
#define MARGIN_RPM    200.0
#define MARGIN_SHARE  0.15
#define OBEYS_MS      3000u
#define TOLD_MS       500u
#define ANGLE_MS      200u
#define WRONG_Q32     357913941u /* 30 degrees */
#define TELLS_RPM     750        /* the EMF is four times what dead time hides, 0.02 of the bus */
#define FINDINGS_MOST 16

/* What may be tried again without a person: docs/faults.md. */
#define PASSES(cause) (1ULL << FAULT_##cause)
#define PASSING \
    (PASSES(OVERCURRENT) | PASSES(OVERVOLTAGE) | PASSES(UNDERVOLTAGE) | PASSES(STALL) | PASSES(SPEED_DEVIATION) | \
     PASSES(OVERTEMPERATURE) | PASSES(INVERTER_OVERLOAD) | PASSES(VOLTAGE_LIMIT) | PASSES(LOCK_LOST) | \
     PASSES(OUT_OF_STEP) | PASSES(HALL_INVALID) | PASSES(HALL_SEQUENCE))

const char *const line_names[OWNERS] = {"nobody", "the console", "Modbus", "CAN"};
uint32_t judge_findings;
bool judge_traces;

void judge_wrong(const char *what, ...)
{
    static char said[FINDINGS_MOST][96];
    char text[96];
    va_list values;
    va_start(values, what);
    (void)vsnprintf(text, sizeof text, what, values);
    va_end(values);
    for (uint32_t n = 0; n < judge_findings; n++) {
        if (strcmp(said[n], text) == 0) {
            return;
        }
    }
    if (judge_findings < FINDINGS_MOST) {
        memcpy(said[judge_findings++], text, sizeof text);
        printf("wrong at %u: %s\n", (unsigned)world.now_ms, text);
    }
}

void judge_emergency(uint32_t fault)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        judged[n].told = judged[n].told || world.axes[n].faults.cause == fault;
    }
}

void judge_disturbed(uint32_t ms)
{
    told.calm_ms = world.now_ms + ms > told.calm_ms ? world.now_ms + ms : told.calm_ms;
}

/* ---- each millisecond ---- */

static void report(const char *wrong)
{
    if (wrong != NULL) {
        judge_wrong("%s", wrong);
    }
}

void judge_words(uint32_t n)
{
    report(judge_shown(&judged[n].shown[0], &world.modbus.drives[n].cia402, &world.axes[n]));
    report(judge_shown(&judged[n].shown[1], &world.canopen.drives[n].cia402, &world.axes[n]));
}

/* Counts while it is so; whether for longer than that. */
static bool lasts(uint32_t *for_ms, bool so, uint32_t limit_ms)
{
    *for_ms = so ? *for_ms + 1u : 0u;
    return *for_ms > limit_ms;
}

static void watch_owner(struct judged *j, uint32_t n)
{
    const struct axis *const a = &world.axes[n];
    const uint32_t limit_ms = (uint32_t)a->params.command_timeout_ms, silent_ms = limit_ms + LATE_MS;
    const bool faulty = a->faults.cause != FAULT_NONE;
    if (j->owner == OWNER_CAN && told.consumer_ms != 0u &&
        (int32_t)(world.now_ms - told.beat_ms) > (int32_t)(told.consumer_ms + LATE_MS)) {
        judge_lost(OWNER_CAN, "heartbeat lost");
        told.consumer_ms = 0u;
    }
    if (j->owner == OWNER_CAN && world.cut != 0) {
        judge_lost(OWNER_CAN, "bus off");
    }
    if (world_wants(n) && limit_ms != 0u && world.now_ms - j->heard_ms > silent_ms &&
        world.now_ms - j->since_ms > silent_ms) {
        owner_given_up(j, "command time-out", world_operates(n) ? STOP_MS : START_MS);
    }
    const bool was_on = j->state == AXIS_SWITCHED_ON || j->state == AXIS_OPERATION_ENABLED;
    if (was_on && a->state == AXIS_SWITCH_ON_DISABLED && !faulty && j->owner != OWNER_NONE && !j->measures &&
        world.now_ms - j->since_ms > 1u) {
        judge_wrong("it has ended, and nobody has asked for that");
    }
    if (lasts(&j->misnamed_ms, world_operates(n) && j->owner != OWNER_NONE && a->owner.who != j->owner, LATE_MS)) {
        judge_wrong("it names another owner than %s, who commands", line_names[j->owner]);
    }
    j->state = a->state;
    if (!world_wants(n) && !world_is_live(n) && !faulty) {
        owner_given_up(j, "its end", 0u);
    }
}

static void watch_gates(struct judged *j, uint32_t n)
{
    const bool live = world_is_live(n);
    if (live && !j->live && j->owner == OWNER_NONE && world.now_ms - j->lost_ms > LATE_MS) {
        judge_wrong("gates open after %s %s", j->lost, j->when);
    } else if (live && j->owner == OWNER_NONE && world.now_ms - j->lost_ms > j->within_ms) {
        judge_wrong("gates still live after %s %s", j->lost, j->when);
    }
    j->live = live;
}

static double least(double x, double y)
{
    return x < y ? x : y;
}

static double most(double x, double y)
{
    return x > y ? x : y;
}

/* What the owner has asked for within the ramp's time, and standstill. */
static void follow_hull(struct judged *j, double asked_rpm)
{
    const double low = least(asked_rpm, 0), high = most(asked_rpm, 0);
    const bool wider = low < j->low_rpm || high > j->high_rpm;
    j->held_ms = wider || (low == j->low_rpm && high == j->high_rpm) ? 0u : j->held_ms + 1u;
    const double by_rpm = j->held_ms > HOLD_MS ? HULL_RPM_MS : 0;
    j->low_rpm = least(low, j->low_rpm + by_rpm);
    j->high_rpm = most(high, j->high_rpm - by_rpm);
}

static void watch_motion(struct judged *j, uint32_t n)
{
    const struct axis *const a = &world.axes[n];
    const double rpm = plant_rpm(&world.plants[n]) * axis_forward(a), asked_rpm = j->asked_rpm[j->owner];
    const bool told_so = a->faults.cause != FAULT_NONE || (a->reports.warned[0] | a->reports.warned[1]) != 0u;
    const bool runs = world_operates(n), commanded = runs && j->owner != OWNER_NONE;
    const bool calm = (int32_t)(world.now_ms - told.calm_ms) > 0 && !j->free;
    if (!runs) { /* a rotor that turns is caught as it is */
        j->low_rpm = least(rpm, 0);
        j->high_rpm = most(rpm, 0);
    }
    follow_hull(j, asked_rpm);
    if (calm && commanded &&
        (rpm < j->low_rpm * (1 + MARGIN_SHARE) - MARGIN_RPM || rpm > j->high_rpm * (1 + MARGIN_SHARE) + MARGIN_RPM)) {
        judge_wrong("motion that its owner, %s, has not asked for", line_names[j->owner]);
    }
    const double off = most(rpm - asked_rpm, asked_rpm - rpm), few = MARGIN_RPM / 2 + most(asked_rpm, -asked_rpm) / 4;
    if (lasts(&j->astray_ms, calm && commanded && !j->returns && !told_so && off > few, OBEYS_MS)) {
        judge_wrong("its owner, %s, is not obeyed", line_names[j->owner]);
    }
    const uint32_t apart = current_loop_angle_q32(&a->loop) - plant_angle_q32(&world.plants[n]);
    const bool wrong = runs && world_is_live(n) && !told_so && a->loop.source == LOOP_ENCODER &&
                       most(rpm, -rpm) > TELLS_RPM && apart + WRONG_Q32 > 2u * WRONG_Q32;
    if (lasts(&j->angle_ms, wrong, ANGLE_MS)) {
        judge_wrong("a wrong angle, and nobody is told");
    }
}

static void see_fault(struct judged *j, const struct axis *a, uint32_t cause)
{
    if (j->cause != FAULT_NONE) {
        judge_wrong("the first cause did not stay");
    }
    if ((PASSING >> cause & 1u) == 0u) {
        owner_given_up(j, "a fault that does not pass", STOP_MS);
    }
    if ((told.explained >> cause & 1u) == 0u &&
        !(cause == FAULT_COMMAND_TIMEOUT && a->params.command_timeout_ms != 0)) {
        judge_wrong("fault %u that nothing explains", (unsigned)cause);
    }
    j->returns = true;
}

static void watch_fault(struct judged *j, uint32_t n)
{
    const struct axis *const a = &world.axes[n];
    const uint32_t cause = a->faults.cause;
    if (cause != FAULT_NONE && cause != j->cause) {
        see_fault(j, a, cause);
    }
    const bool hears = world_can_is_up() && world.canopen.state != NMT_STOPPED;
    j->told = j->told && cause != FAULT_NONE;
    if (lasts(&j->untold_ms, cause != FAULT_NONE && !j->told && hears, TOLD_MS)) {
        judge_wrong("a fault that the CAN bus is not told of");
    }
    j->cause = cause;
    report(judge_axis(a, world_is_live(n)));
}

/* What changes, for a person. */
static void trace(uint32_t n)
{
    static uint32_t before[AXIS_COUNT][4];
    const uint32_t now[4] = {world.axes[n].state, world.axes[n].faults.cause, world_is_live(n), judged[n].owner};
    if (judge_traces && memcmp(now, before[n], sizeof now) != 0) {
        printf("%6u ms, axis %u: state %u, fault %u, %s, %s commands, %.0f rpm\n", (unsigned)world.now_ms,
               (unsigned)n + 1u, (unsigned)now[0], (unsigned)now[1], now[2] != 0u ? "live" : "dark", line_names[now[3]],
               plant_rpm(&world.plants[n]));
        memcpy(before[n], now, sizeof now);
    }
}

void judge_millisecond(void)
{
    for (uint32_t n = 0; n < AXIS_COUNT && world.powered; n++) {
        watch_owner(&judged[n], n);
        watch_gates(&judged[n], n);
        watch_motion(&judged[n], n);
        watch_fault(&judged[n], n);
        judge_words(n);
        trace(n);
    }
}

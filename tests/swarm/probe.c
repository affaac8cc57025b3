/* SPDX-License-Identifier: MIT */
/* Behind the last fault: the drive can be used, or says what is wrong. */
#include <stdio.h>

#include "swarm.h"

#define DARK_MS   32u
#define QUIET_MS  5000u
#define REST_MS   100u
#define ON_MS     6000u
#define BRAKE_MNM 50
#define PROBE_RPM 300 /* and in the line below */
#define PROBE_MS  1500u
#define SPEAKS_MS 50u /* with a command time-out, who commands has to */

static bool speaks; /* a person is there */

/* A brake holds what is off, or its inertia would keep it turning for longer than anybody waits. */
static void pass(uint32_t ms)
{
    while (ms-- > 0u) {
        if (speaks && world.now_ms % SPEAKS_MS == 0u) {
            (void)judge_type(" ");
        }
        for (uint32_t n = 0; n < AXIS_COUNT; n++) {
            world.plants[n].load_mnm = world_is_live(n) ? 0 : BRAKE_MNM;
        }
        world_millisecond();
        judge_millisecond();
    }
}

static uint32_t fault_of(uint32_t n)
{
    return world.axes[n].faults.cause;
}

static bool at_rest(uint32_t n)
{
    const struct axis *const a = &world.axes[n];
    const bool off = fault_of(n) != FAULT_NONE ? a->state == AXIS_FAULT && !a->retry.waiting : !world_wants(n);
    return off && !world_is_live(n) && world.plants[n].w_rad_s == 0;
}

static bool is_dark(uint32_t n)
{
    return !world_is_live(n) && !world_wants(n);
}

static bool turns(uint32_t n)
{
    const double rpm = plant_rpm(&world.plants[n]) * axis_forward(&world.axes[n]);
    return rpm > PROBE_RPM * 0.7 && rpm < PROBE_RPM * 1.3;
}

/* False: not within this time, or a fault comes first. */
static bool comes(bool (*what)(uint32_t), uint32_t axis, uint32_t within_ms)
{
    const uint32_t cause = fault_of(axis);
    for (uint32_t ms = 0; ms < within_ms && !what(axis) && fault_of(axis) == cause; ms++) {
        pass(1);
    }
    return what(axis);
}

/* And waits for that. */
static bool type(uint32_t axis, const char *command, bool (*what)(uint32_t), uint32_t within_ms)
{
    char text[40];
    snprintf(text, sizeof text, AXIS_COUNT == 2u ? "axis %u %s" : "%.0u%s", AXIS_COUNT == 2u ? axis + 1u : 0u, command);
    (void)judge_type(text);
    pass(1);
    return comes(what, axis, within_ms);
}

/* Clears twice what is latched: once may be too soon. What was broken may show once more, and so does an encoder that has
 * slipped while nothing was on, or an offset that was learned from wrong currents. */
static bool switches_on(uint32_t n)
{
    const int attempts =
        judged[n].slipped || fault_of(n) != FAULT_NONE || (told.explained >> FAULT_OFFSET & 1u) ? 2 : 1;
    for (int times = 0; times < attempts; times++) {
        for (int clears = 0; clears < 2 && fault_of(n) != FAULT_NONE; clears++) {
            (void)type(n, "clear", is_dark, 0u);
            pass(5);
        }
        if (fault_of(n) != FAULT_NONE) {
            judge_wrong("fault %u cannot be cleared although its cause is gone", (unsigned)fault_of(n));
            return false;
        }
        if (type(n, "on", world_operates, ON_MS)) {
            return true;
        }
    }
    judge_wrong("not usable: it does not switch on, fault %u", (unsigned)fault_of(n));
    return false;
}

/* Without a person, or one has come and cleared what is latched: the drive works. */
static void probe(uint32_t n)
{
    if (!switches_on(n)) {
        return;
    }
    if (!type(n, "speed 300", turns, PROBE_MS)) {
        judge_wrong("not usable: it does not turn, fault %u", (unsigned)fault_of(n));
    }
    (void)type(n, "off", is_dark, DARK_MS);
    pass(2);
}

/* Off, or it operates for an owner of whom nobody could know that it is gone. */
static bool settled(uint32_t n)
{
    return at_rest(n) || (world_operates(n) && judged[n].owner != OWNER_NONE && !judge_watches(n));
}

void judge_end(void)
{
    uint32_t still_ms = 0;
    for (uint32_t ms = 0; ms < QUIET_MS && still_ms < REST_MS; ms++) {
        pass(1);
        still_ms = settled(0) && settled(AXIS_COUNT - 1u) ? still_ms + 1u : 0u;
    }
    speaks = true;
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        if (judged[n].owner != OWNER_NONE && world_wants(n)) {
            (void)type(n, "off", at_rest, QUIET_MS);
        }
        if (world_is_live(n) && judged[n].owner == OWNER_NONE) {
            continue; /* said already */
        }
        if (at_rest(n)) {
            probe(n);
        } else {
            judge_wrong("neither usable nor a latched fault after 5 s: state %u", (unsigned)world.axes[n].state);
        }
    }
}

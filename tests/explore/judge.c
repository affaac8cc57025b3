/* SPDX-License-Identifier: MIT */
#include "judge.h"

#include <stdio.h>
#include <string.h>

#include "adapter.h"

/*
 * The transitions of CiA 402 (IEC 61800-7-201), by what the status word shows: 0x00 not ready, 0x40 switch on disabled,
 * 0x21 ready to switch on, 0x23 switched on, 0x27 operation enabled, 0x07 quick stop active, 0x0F fault reaction active,
 * 0x08 fault.
 */
static const uint8_t legal[][2] = {
    {0x00, 0x40}, {0x40, 0x21}, {0x21, 0x23}, {0x23, 0x27}, {0x27, 0x23}, {0x23, 0x21}, {0x21, 0x40}, /* 1 to 7 */
    {0x27, 0x21}, {0x27, 0x40}, {0x23, 0x40}, {0x27, 0x07}, {0x07, 0x40},                             /* 8 to 12 */
    {0x0F, 0x08}, {0x08, 0x40}, {0x07, 0x27},                                                         /* 14 to 16 */
    {0x40, 0x23}, /* 2 and 3 at once: whom the console switches on has no master to wait for */
};
#define LEGAL (sizeof legal / sizeof legal[0])
static uint32_t legal_seen[LEGAL];

static const char *illegal(uint32_t from, uint32_t to)
{
    static char what[64];
    if (from == to || to == 0x0Fu) { /* 13: from any state */
        return NULL;
    }
    for (size_t n = 0; n < LEGAL; n++) {
        if (legal[n][0] == from && legal[n][1] == to) {
            legal_seen[n]++;
            return NULL;
        }
    }
    memcpy(what, "status word: from 0x.. to 0x..", 31);
    what[20] = "0123456789ABCDEF"[from >> 4];
    what[21] = "0123456789ABCDEF"[from & 15u];
    what[28] = "0123456789ABCDEF"[to >> 4];
    what[29] = "0123456789ABCDEF"[to & 15u];
    return what;
}

void explore_print_transitions(void)
{
    for (size_t n = 0; n < LEGAL; n++) {
        printf("  status word 0x%02X to 0x%02X %llu times\n", legal[n][0], legal[n][1],
               (unsigned long long)legal_seen[n]);
    }
}

static bool beyond(int64_t x, int64_t limit)
{
    return x > limit || x < -limit;
}

static const char *judge_set_points(const struct axis *a)
{
    if (a->state != AXIS_OPERATION_ENABLED) {
        return NULL;
    }
    const int64_t most = (int64_t)a->params.speed_max_rpm * 65536;
    const bool cyclic = a->mode == AXIS_MODE_CYCLIC_SPEED && beyond(a->motion.cyclic.target, most);
    if ((a->mode == AXIS_MODE_SPEED && beyond(a->speed.target_rpm_q16, most)) || cyclic) {
        return "a speed beyond speed_max is in effect";
    }
    const int32_t torque_most_q15 = a->torque.map.torque_max_q15;
    const bool pushes = a->mode == AXIS_MODE_CYCLIC_TORQUE && beyond(a->motion.cyclic.target >> 16, torque_most_q15);
    if (beyond(a->torque_command_q15, torque_most_q15) || pushes) {
        return "a torque beyond i_max is in effect";
    }
    return NULL;
}

const char *judge_axis(const struct axis *a, bool live)
{
    const bool stops = a->reactions.stopping && (a->state == AXIS_OPERATION_ENABLED || a->state == AXIS_QUICK_STOP);
    return a->faults.cause != FAULT_NONE && live && !stops ? "a latched fault and open gates" : judge_set_points(a);
}

uint32_t judge_state_shown(const struct cia402 *c, const struct axis *a)
{
    const struct drive_status now = drive_status(a);
    const uint32_t word = cia402_status_word(c, a, &now);
    return (word & 0x40u) != 0u && (word & 0x20u) == 0u ? word & 0x4Fu : word & 0x6Fu;
}

const char *judge_shown(uint32_t *before, const struct cia402 *c, const struct axis *a)
{
    const uint32_t from = *before;
    *before = judge_state_shown(c, a);
    return illegal(from, *before);
}

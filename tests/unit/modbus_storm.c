/* SPDX-License-Identifier: MIT */
/*
 * A million frames on the line of a drive in operation: noise, torn and mutated requests, traffic of others with requests
 * inside, and requests that are right, with or without a silence between. Who judges knows each byte that was sent and
 * reckons the check sum by itself: nothing of the drive may change, and nothing be answered, but at the last byte of a frame
 * that fits, to this drive; and what such a request wrote is what its reply says.
 *
 *     modbus_storm FRAMES SEED        prints the counts by name; what must not be is counted, too
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bus.h"
#include "envm.h"
#include "firmware/operate/modbus.h"
#include "storm_frames.h"

struct counts {
    long frames, right, answered, exceptions, written, mutated, foreign, noise;
    long changed_by_nothing, answered_nothing, wrong_reply, late_reply, refused_but_changed, unanswered;
};

static struct fabric fabric;
static struct axis axis;
static struct rs485 line;
static struct modbus modbus;
static struct counts counts;

/* ---- what it does ---- */

/* All that a request may write, and what follows from it at once. */
struct state {
    struct params params;
    struct cia402_setpoints setpoints;
    uint8_t choice[FAULT_COUNT];
    uint32_t mode, request, state;
    int32_t target, torque;
};

static void look(struct state *s)
{
    memset(s, 0, sizeof *s);
    s->params = axis.params;
    s->setpoints = modbus.drives[0].cia402.setpoints;
    memcpy(s->choice, axis.reactions.choice, sizeof s->choice);
    s->mode = axis.mode;
    s->request = axis.request;
    s->state = axis.state;
    s->target = axis.speed.target_rpm_q16;
    s->torque = axis.torque_command_q15;
}

static void rest(uint32_t ms)
{
    host_bus_marks = ms > 0u ? MMUART_RX_SILENCE : 0u;
    for (uint32_t n = 0; n < ms; n++) {
        axis.time_ms++;
        modbus_poll(&modbus);
    }
}

/* Puts the drive back to where requests find something to do: on or off, the address as it was. */
static void restore(bool on)
{
    axis.request = AXIS_REQUEST_NONE;
    axis.faults.cause = FAULT_NONE;
    axis.state = on ? AXIS_OPERATION_ENABLED : AXIS_SWITCH_ON_DISABLED;
    axis.params.modbus_address = US;
    axis.params.modbus_baud = 115200;
    axis.params.modbus_parity = 0;
    modbus_poll(&modbus);
}

static bool answers_right(const uint8_t *asked, const uint8_t *reply, size_t count)
{
    return fits(reply, count) && reply[0] == US && (reply[1] & 0x7Fu) == asked[1] &&
           ((reply[1] & 0x80u) == 0u || (count == 5u && reply[2] >= 1u && reply[2] <= 4u));
}

/* What must be so when a frame that fits has ended. */
static void judge(const uint8_t *bytes, const struct state *before)
{
    struct state after;
    const bool broadcast = bytes[0] == 0u;
    const bool refused = host_bus_sent_bytes > 2u && (host_bus_sent[1] & 0x80u) != 0u;
    look(&after);
    const bool changed = memcmp(before, &after, sizeof after) != 0;
    counts.right++;
    counts.answered += host_bus_sent_bytes > 0u;
    counts.exceptions += refused;
    counts.written += changed;
    counts.answered_nothing += broadcast && host_bus_sent_bytes > 0u;
    counts.unanswered += !broadcast && host_bus_sent_bytes == 0u;
    counts.wrong_reply +=
        !broadcast && host_bus_sent_bytes > 0u && !answers_right(bytes, host_bus_sent, host_bus_sent_bytes);
    counts.refused_but_changed += refused && memcmp(&before->params, &after.params, sizeof after.params) != 0;
    counts.refused_but_changed += refused && memcmp(&before->setpoints, &after.setpoints, sizeof after.setpoints) != 0;
}

static void send(const uint8_t *bytes, size_t count, bool right)
{
    struct state before, after;
    look(&before);
    host_bus_sent_bytes = 0;
    memcpy(host_bus_heard, bytes, count);
    host_bus_heard_bytes = (uint32_t)count;
    host_bus_heard_taken = 0;
    modbus_poll(&modbus);
    if (right) {
        judge(bytes, &before);
    } else {
        look(&after);
        counts.changed_by_nothing += memcmp(&before, &after, sizeof after) != 0;
        counts.answered_nothing += host_bus_sent_bytes > 0u;
    }
    host_bus_sent_bytes = 0;
    line.driving = false;
    modbus_poll(&modbus);
    while (drive_prepare(&axis)) {
    }
}

static void one_frame(void)
{
    uint8_t bytes[BYTES_MOST];
    size_t count;
    bool chance;
    const enum frame_kind kind = some_frame(bytes, &count, &chance);
    counts.frames++;
    counts.mutated += kind == FRAME_MUTATED;
    counts.foreign += kind == FRAME_FOREIGN;
    counts.noise += kind == FRAME_NOISE;
    if (!chance) {
        send(bytes, count, kind == FRAME_RIGHT);
    }
    /* behind what is no frame the line must fall silent; behind a frame it need not */
    rest(kind == FRAME_MUTATED || kind == FRAME_NOISE ? MODBUS_PATIENCE_MS + 5u : any(3));
    counts.late_reply += host_bus_sent_bytes > 0u;
    host_bus_sent_bytes = 0;
}

int main(int argc, char **argv)
{
    const long frames = argc > 1 ? atol(argv[1]) : 1000000;
    seed = argc > 2 ? (uint32_t)atol(argv[2]) : 12345u;
    drive_init(&axis, &fabric);
    axis.fabric_doubt = 0;
    axis.loop.vbus_q15 = axis.tuning.v_min_q15 + 100;
    host_envm_new(&axis, 8e-3, 1u);
    const struct slots slots = host_slots();
    modbus_start(&modbus, &line, &axis, &slots);
    for (long n = 0; n < frames; n++) {
        if (n % 8 == 0) {
            restore(n % 16 == 0);
        }
        one_frame();
    }
    printf("frames %ld\nright %ld\nanswered %ld\nexceptions %ld\nwritten %ld\nmutated %ld\nforeign %ld\nnoise %ld\n",
           counts.frames, counts.right, counts.answered, counts.exceptions, counts.written, counts.mutated,
           counts.foreign, counts.noise);
    printf("changed_by_nothing %ld\nanswered_nothing %ld\nwrong_reply %ld\nlate_reply %ld\nrefused_but_changed "
           "%ld\nunanswered %ld\n",
           counts.changed_by_nothing, counts.answered_nothing, counts.wrong_reply, counts.late_reply,
           counts.refused_but_changed, counts.unanswered);
    return 0;
}

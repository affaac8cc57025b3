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

#define US         1
#define BYTES_MOST 600

struct counts {
    long frames, right, answered, exceptions, written, mutated, foreign, noise;
    long changed_by_nothing, answered_nothing, wrong_reply, late_reply, refused_but_changed, unanswered;
};

static struct fabric fabric;
static struct axis axis;
static struct rs485 line;
static struct modbus modbus;
static struct counts counts;
static uint32_t seed;

static uint32_t any(uint32_t below)
{
    seed ^= seed << 13;
    seed ^= seed >> 17;
    seed ^= seed << 5;
    return seed % below;
}

static uint32_t check_sum(const uint8_t *bytes, size_t count)
{
    uint32_t value = 0xFFFF;
    for (size_t n = 0; n < count; n++) {
        value ^= bytes[n];
        for (int bit = 0; bit < 8; bit++) {
            value = (value >> 1) ^ ((value & 1u) != 0u ? 0xA001u : 0u);
        }
    }
    return value;
}

static bool fits(const uint8_t *bytes, size_t count)
{
    return count >= 4u && check_sum(bytes, count - 2u) == (uint32_t)(bytes[count - 2u] | bytes[count - 1u] << 8);
}

static size_t close_frame(uint8_t *bytes, size_t count)
{
    const uint32_t sum = check_sum(bytes, count);
    bytes[count] = (uint8_t)sum;
    bytes[count + 1u] = (uint8_t)(sum >> 8);
    return count + 2u;
}

/* ---- what is sent ---- */

static uint32_t some_register(void)
{
    static const uint16_t starts[] = {0,  1,   2,   4,     6,     7,      8,      16,     18,    43,
                                      64, 128, 192, 0x400, 0x408, 0x1000, 0x1002, 0x1020, 0x1060};
    return any(8) == 0u ? any(65536) : starts[any(sizeof starts / sizeof starts[0])] + (any(3) == 0u ? any(8) : 0u);
}

static void put(uint8_t *bytes, uint32_t value)
{
    bytes[0] = (uint8_t)(value >> 8);
    bytes[1] = (uint8_t)value;
}

static void fill(uint8_t *bytes, size_t count)
{
    for (size_t n = 0; n < count; n++) {
        bytes[n] = any(2) != 0u ? (uint8_t)any(256) : 0u;
    }
}

/* A request of one of the functions that there are, to `unit`. */
static size_t request(uint8_t *bytes, uint8_t unit)
{
    static const uint8_t functions[] = {3, 4, 6, 16, 22, 23, 0x2B};
    const uint8_t function = functions[any(sizeof functions)];
    const uint32_t count = 1u + any(any(4) == 0u ? 123 : 8);
    bytes[0] = unit;
    bytes[1] = function;
    put(&bytes[2], some_register());
    put(&bytes[4], any(16) == 0u ? any(65536) : count);
    switch (function) {
    case 6:
        put(&bytes[4], any(65536));
        return close_frame(bytes, 6);
    case 16:
        put(&bytes[4], count);
        bytes[6] = (uint8_t)(2u * count);
        fill(&bytes[7], 2u * count);
        return close_frame(bytes, 7u + 2u * count);
    case 22:
        fill(&bytes[4], 4);
        return close_frame(bytes, 8);
    case 23: {
        const uint32_t writes = count < 118u ? count : 118u;
        put(&bytes[4], 1u + any(8));
        put(&bytes[6], some_register());
        put(&bytes[8], writes);
        bytes[10] = (uint8_t)(2u * writes);
        fill(&bytes[11], 2u * writes);
        return close_frame(bytes, 11u + 2u * writes);
    }
    case 0x2B:
        bytes[2] = 14;
        bytes[3] = (uint8_t)any(6);
        bytes[4] = (uint8_t)any(9);
        return close_frame(bytes, 5);
    default:
        return close_frame(bytes, 6);
    }
}

/* What another slave answers: a whole request to this drive may be inside. */
static size_t foreign_reply(uint8_t *bytes)
{
    uint8_t inside[BYTES_MOST];
    size_t count = request(inside, (uint8_t)(any(3) == 0u ? 0u : US));
    count = count > 240u ? 240u : count;
    const size_t lead = any(8);
    bytes[0] = (uint8_t)(2u + any(200));
    bytes[1] = (uint8_t)(3u + any(2));
    bytes[2] = (uint8_t)(lead + count);
    fill(&bytes[3], lead);
    memcpy(&bytes[3u + lead], inside, count);
    return close_frame(bytes, 3u + lead + count);
}

static size_t mutate(uint8_t *bytes, size_t count)
{
    switch (any(4)) {
    case 0: /* torn */
        return any((uint32_t)count);
    case 1: /* a byte more */
        bytes[count] = (uint8_t)any(256);
        return count + 1u;
    case 2: /* a byte missing */ {
        const size_t at = any((uint32_t)count);
        memmove(&bytes[at], &bytes[at + 1u], count - at - 1u);
        return count - 1u;
    }
    default:
        for (uint32_t bits = 1u + any(5); bits > 0u; bits--) {
            bytes[any((uint32_t)count)] ^= (uint8_t)(1u << any(8));
        }
        return count;
    }
}

/* ---- what it does ---- */

/* All that a request may write, and what follows from it at once. */
struct state {
    struct params params;
    struct cia402_wishes wishes;
    uint8_t choice[FAULT_COUNT];
    uint32_t mode, request, state;
    int32_t target, torque;
};

static void look(struct state *s)
{
    memset(s, 0, sizeof *s);
    s->params = axis.params;
    s->wishes = modbus.drive.cia402.wishes;
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
    counts.refused_but_changed += refused && memcmp(&before->wishes, &after.wishes, sizeof after.wishes) != 0;
}

static void send(const uint8_t *bytes, size_t count, bool meant, bool known)
{
    struct state before, after;
    look(&before);
    host_bus_sent_bytes = 0;
    memcpy(host_bus_heard, bytes, count);
    host_bus_heard_bytes = (uint32_t)count;
    host_bus_heard_taken = 0;
    modbus_poll(&modbus);
    if (meant && known) {
        judge(bytes, &before);
    } else {
        look(&after);
        counts.changed_by_nothing += memcmp(&before, &after, sizeof after) != 0;
        counts.answered_nothing += host_bus_sent_bytes > 0u;
    }
    host_bus_sent_bytes = 0;
    line.driving = false;
    modbus_poll(&modbus);
    while (axis_prepare(&axis)) {
    }
}

static void one_frame(void)
{
    uint8_t bytes[BYTES_MOST];
    size_t count = request(bytes, (uint8_t)(any(4) == 0u ? 0u : US));
    const uint32_t kind = any(4);
    counts.frames++;
    if (kind == 1u) {
        count = mutate(bytes, count);
        counts.mutated++;
    } else if (kind == 2u) {
        count = foreign_reply(bytes);
        counts.foreign++;
    } else if (kind == 3u) {
        count = 1u + any(300);
        for (size_t n = 0; n < count; n++) {
            bytes[n] = (uint8_t)any(256);
        }
        counts.noise++;
    }
    /* A check sum of 16 bits fits by chance once in 65536: then a mutated frame or noise is a request like others, and a
     * part of another slave's frame looks like a frame. Such are not sent. */
    bool chance = false;
    const size_t whole = kind == 2u ? count - 1u : count;
    for (size_t n = 4; kind != 0u && n <= whole; n++) {
        chance = chance || ((kind == 2u || bytes[0] == US || bytes[0] == 0u) && fits(bytes, n));
    }
    if (!chance) {
        send(bytes, count, kind == 0u, kind == 0u);
    }
    /* behind what is no frame the line must fall silent; behind a frame it need not */
    rest(kind == 1u || kind == 3u ? MODBUS_PATIENCE_MS + 5u : any(3));
    counts.late_reply += host_bus_sent_bytes > 0u;
    host_bus_sent_bytes = 0;
}

int main(int argc, char **argv)
{
    const long frames = argc > 1 ? atol(argv[1]) : 1000000;
    seed = argc > 2 ? (uint32_t)atol(argv[2]) : 12345u;
    axis_init(&axis, &fabric);
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

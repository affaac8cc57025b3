/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "can_device.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "qemu_api.h"
#include "socketcand.h"

#define JOIN_MS    100
#define SPARE_ROOM 64 /* frames: one takes more characters than one */

static struct vm_chardev *device;
static struct can_device_hooks bus;
static struct can_speaker speaker;
static bool shared; /* with programs and twins, by can_link.h */
static struct can_others there;
static struct can_node told;
static uint32_t warned_bit_ns; /* the rate of which the warning has been written */
static bool listens;           /* a program that speaks slcan */
static int64_t attached_ms;

static void say(const char *text, size_t length)
{
    if (device && length > 0) {
        vm_chardev_send(device, text, length);
    }
}

/* ---- a program that speaks slcan ---- */

static int64_t host_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000LL + now.tv_nsec / 1000000;
}

/* A client may take for the last answer all that comes at once, so that a frame right behind it would spoil it: he is not there
 * until he has said something, or some time has passed. Of the host's time, which is the only one that he knows. */
static bool he_listens(void)
{
    if (speaker.attached && !listens && host_ms() - attached_ms > JOIN_MS) {
        listens = true;
    }
    return listens;
}

static void program_speaks(char c)
{
    bool was = speaker.attached;
    struct can_heard heard = can_hear(&speaker, c);
    listens = speaker.attached && (listens || heard.sends);
    attached_ms = speaker.attached && !was ? host_ms() : attached_ms;
    if (heard.sends) {
        bus.send(&heard.frame);
    }
    if (heard.answer) {
        say(heard.answer, strlen(heard.answer));
    }
}

/* ---- a bus that others share ---- */

/* A real drive of the wrong rate shows it by errors alone, too; but here somebody may read it. */
static void warn(void)
{
    if (there.differ && told.bit_ns > 0 && told.bit_ns != warned_bit_ns) {
        fprintf(stderr,
                "mssfoc twin: can: another drive on the bus has another can_kbit than this one's %u: they destroy"
                " each other's frames\n",
                1000000u / told.bit_ns);
        warned_bit_ns = told.bit_ns;
    }
}

static void bus_speaks(char c)
{
    const char *command = can_command(&speaker, c);
    struct can_said said = command ? can_link_read(command) : (struct can_said){.kind = CAN_SAYS_NOTHING};
    if (said.kind == CAN_SAYS_WIRE) {
        bus.send(&said.frame);
    } else if (said.kind == CAN_SAYS_NOISE) {
        bus.destroy();
    } else if (said.kind == CAN_SAYS_OTHERS) {
        there = said.others;
        warn();
    }
}

void can_device_node(struct can_node node)
{
    char text[CAN_TEXT_BYTES];
    if (shared && (node.bit_ns != told.bit_ns || node.passive != told.passive)) {
        told = node;
        say(text, can_link_node(node, text));
        warn();
    }
}

/* ---- either ---- */

static int device_room(void *unused)
{
    (void)unused;
    unsigned frames = bus.room();
    return frames > SPARE_ROOM ? (int)frames : 0;
}

static void hear(void *unused, const uint8_t *bytes, int count)
{
    (void)unused;
    for (int n = 0; n < count; n++) {
        (shared ? bus_speaks : program_speaks)((char)bytes[n]);
    }
}

/* One who goes takes with him what he has said so far. */
static void changes(void *unused, int event)
{
    (void)unused;
    (void)event;
    (void)can_greet(&speaker);
    listens = false;
    there = (struct can_others){false, false};
}

bool can_device_hears(void)
{
    return shared ? there.hear : he_listens();
}

bool can_device_destroys(void)
{
    return there.differ;
}

void can_device_tell(const struct can_frame *f)
{
    char text[CAN_TEXT_BYTES];
    if (shared) {
        say(text, can_link_wire(f, vm_now_ns(), text));
    } else if (listens) {
        say(text, can_tell(&speaker, f, vm_now_ns(), text));
    }
}

void can_device_noise(void)
{
    if (shared) {
        say(CAN_LINK_NOISE, strlen(CAN_LINK_NOISE));
    }
}

void can_device_open(const char *chardev_id, bool slcan, struct can_device_hooks hooks)
{
    char text[CAN_TEXT_BYTES];
    bus = hooks;
    shared = !slcan;
    speaker.slcan = slcan;
    if (!(device = vm_chardev_open(chardev_id, device_room, hear, changes))) {
        fprintf(stderr, "mssfoc twin: QEMU has no character device '%s'\n", chardev_id);
        exit(1);
    }
    if (shared) {
        say(text, can_link_node(told, text)); /* a twin is known by it */
    }
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "can_bus.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "can.h"
#include "can_device.h"
#include "qemu_api.h"
#include "sysreg.h"

#define CAN_IRQ       16
#define QUEUE         4096u
#define ERROR_BITS    23   /* flag, its echo, delimiter, pause */
#define RECOVERY_BITS 1408 /* 128 times 11 */

static struct can can;
static struct can_frame queue[QUEUE]; /* what others have yet to send */
static unsigned queue_from, queue_to;
static struct {
    bool busy, ours, broken;
    int mailbox;
    struct can_frame frame;
} wire;
static bool unheard;     /* the frame before, too: it is noted once */
static bool others, cut; /* others of a scenario are there; the cable is cut */
static unsigned to_break;
static struct vm_timer *end_timer, *recovery_timer;
static FILE *log_file;

static void begin(void);

static void note(const char *what, const struct can_frame *f)
{
    if (!log_file) {
        return;
    }
    fprintf(log_file, "%lld %s", (long long)vm_now_ns(), what);
    if (f) {
        fprintf(log_file, " %0*x%s", f->extended ? 8 : 3, (unsigned)f->id, f->remote ? " R" : f->count ? " " : "");
        for (unsigned n = 0; n < f->count && !f->remote; n++) {
            fprintf(log_file, "%02x", f->data[n]);
        }
    }
    fputc('\n', log_file);
}

/* After whatever may have changed the controller. */
static void settle(void)
{
    bool there = !cut && can_acknowledges(&can);
    vm_set_interrupt(CAN_IRQ, can_interrupt(&can));
    can_device_node((struct can_node){there ? (uint32_t)can_bit_ns(&can) : 0, there && can_passive(&can)});
}

static int64_t bits_ns(unsigned bits)
{
    return (int64_t)(can_bit_ns(&can) * bits);
}

static bool somebody_hears(void)
{
    return !cut && (others || can_device_hears());
}

/* ---- one frame ---- */

static void begin(void)
{
    struct can_frame ours;
    if (wire.busy || !end_timer) {
        return;
    }
    int mailbox = can_offer(&can, &ours);
    bool theirs = queue_from != queue_to;
    if (mailbox < 0 && !theirs) {
        return;
    }
    struct can_frame *other = &queue[queue_from % QUEUE];
    bool in_reach = theirs && !cut;
    wire.ours = mailbox >= 0 && !(in_reach && can_frame_rank(other) < can_frame_rank(&ours));
    if (mailbox >= 0 && !wire.ours) {
        can_lost_arbitration(&can, mailbox);
        settle();
    }
    wire.frame = wire.ours ? ours : *other;
    wire.mailbox = mailbox;
    queue_from += !wire.ours;
    wire.busy = true;
    bool by_event = wire.ours && to_break > 0;
    to_break -= by_event;
    wire.broken = by_event || (wire.ours && !cut && can_device_destroys());
    unsigned bits = can_frame_bits(&wire.frame);
    bool whole = !wire.broken && (!wire.ours || somebody_hears());
    vm_timer_at(end_timer, vm_now_ns() + bits_ns(whole ? bits : bits + ERROR_BITS));
}

static void our_frame_ends(void)
{
    bool was_off = can.bus_off;
    if (wire.broken) {
        can_failed(&can, wire.mailbox, CAN_BIT_ERROR);
        note("broken", &wire.frame);
        if (!cut) {
            can_device_noise();
        }
    } else if (!somebody_hears()) {
        can_failed(&can, wire.mailbox, CAN_ACK_ERROR);
        if (!unheard) {
            note("unheard", &wire.frame);
        }
        unheard = true;
    } else {
        can_sent(&can, wire.mailbox);
        unheard = false;
        note("tx", &wire.frame);
        can_device_tell(&wire.frame);
    }
    if (can.bus_off && !was_off) {
        note("off", NULL);
    }
}

static void watch_recovery(void)
{
    if (can_recovers(&can)) {
        vm_timer_at(recovery_timer, vm_now_ns() + bits_ns(RECOVERY_BITS));
    }
}

static void frame_ends(void *unused)
{
    (void)unused;
    wire.busy = false;
    if (wire.ours) {
        our_frame_ends();
        watch_recovery();
    } else {
        note(!cut && can_acknowledges(&can) ? "rx" : "lost", &wire.frame);
        if (!cut) {
            can_received(&can, &wire.frame);
        }
    }
    begin();
    settle();
}

static void recovery_ends(void *unused)
{
    (void)unused;
    if (can_recovers(&can)) {
        can_recovered(&can);
        note("on", NULL);
        begin();
        settle();
    }
}

/* ---- others ---- */

static void they_send(const struct can_frame *f)
{
    if (queue_to - queue_from < QUEUE) {
        queue[queue_to++ % QUEUE] = *f;
        begin();
    }
}

static int hexadecimal_bytes(const char *text, uint8_t *data)
{
    unsigned byte;
    int digits, count = 0;
    for (; count < 8 && sscanf(text, "%2x%n", &byte, &digits) == 1 && digits == 2; text += digits) {
        data[count++] = (uint8_t)byte;
    }
    return *text == '\0' ? count : -1;
}

void can_bus_send(const char *text)
{
    struct can_frame f = {0};
    int digits = 0;
    if (sscanf(text, "%8x%n", &f.id, &digits) == 1 && text[digits] == '#') {
        const char *data = text + digits + 1;
        f.extended = digits > 3;
        f.remote = strcmp(data, "R") == 0;
        int count = f.remote ? 0 : hexadecimal_bytes(data, f.data);
        if (count >= 0 && f.id < (f.extended ? 1u << 29 : 1u << 11)) {
            f.count = (uint8_t)count;
            others = true;
            they_send(&f);
            return;
        }
    }
    fprintf(stderr, "mssfoc twin: can: '%s' is no frame ID#DATA in hexadecimal\n", text);
    exit(1);
}

void can_bus_break(unsigned frames)
{
    to_break = frames;
}

void can_bus_cut(bool is_cut)
{
    cut = is_cut;
    settle();
}

static unsigned room(void)
{
    return QUEUE - (queue_to - queue_from);
}

/* Of two others' frame, or of one at another rate. */
static void they_destroy(void)
{
    if (!cut && can_acknowledges(&can)) {
        can_heard_error(&can, CAN_FORM_ERROR);
        note("noise", NULL);
        settle();
    }
}

/* ---- registers ---- */

static uint32_t region_read(void *unused, uint32_t offset)
{
    (void)unused;
    return sysreg_holds(SYSREG_CAN) ? 0 : can_read(&can, offset);
}

static void region_write(void *unused, uint32_t offset, uint32_t value)
{
    (void)unused;
    if (!sysreg_holds(SYSREG_CAN)) {
        can_write(&can, offset, value);
        begin();
        watch_recovery();
        settle();
    }
}

void can_bus_map(void)
{
    static const struct vm_region region = {"mssfoc-can", CAN_BASE, CAN_BYTES, 4, region_read, region_write, NULL};
    can_power_on(&can);
    vm_map(&region);
}

/* ---- opening, ending ---- */

void can_bus_open(const char *chardev_id, bool slcan, const char *log_path)
{
    end_timer = vm_timer_new(frame_ends, NULL);
    recovery_timer = vm_timer_new(recovery_ends, NULL);
    if (log_path && !(log_file = fopen(log_path, "w"))) {
        fprintf(stderr, "mssfoc twin: can_log %s: %s\n", log_path, strerror(errno));
        exit(1);
    }
    if (chardev_id) {
        can_device_open(chardev_id, slcan, (struct can_device_hooks){room, they_send, they_destroy});
        settle();
    }
}

void can_bus_reset(void)
{
    can_reset(&can);
    if (wire.busy && wire.ours) {
        wire.busy = false;
        vm_timer_stop(end_timer);
    }
    vm_timer_stop(recovery_timer);
    settle();
    begin();
}

void can_bus_note_reset(void)
{
    if (sysreg_holds(SYSREG_CAN)) {
        can_bus_reset();
    }
}

void can_bus_flush(void)
{
    if (log_file) {
        fflush(log_file);
    }
}

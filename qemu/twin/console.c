/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Paced by the virtual clock, so that the same scenario meets the firmware at the same instruction. */
#include "console.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "qemu_api.h"

#define CHARACTER_NS 86806 /* start, 8 data and stop bit at 115200 baud */

static struct vm_chardev *device;
static struct vm_timer *next_character;
static char *queue;
static size_t length, sent;
static bool typing;

static void type_next(void *unused)
{
    (void)unused;
    typing = sent < length;
    if (!typing) {
        return;
    }
    if (vm_type(device, (uint8_t)queue[sent])) {
        sent++; /* with a full receiver the same character comes again: flow control by patience */
    }
    vm_timer_at(next_character, vm_now_ns() + CHARACTER_NS);
}

void console_attach(const char *chardev_id)
{
    device = vm_find_chardev(chardev_id);
    if (!device) {
        fprintf(stderr, "mssfoc twin: QEMU has no character device '%s'\n", chardev_id);
        exit(1);
    }
    next_character = vm_timer_new(type_next, NULL);
}

/* Room for so many more behind what is queued. */
static void make_room(size_t more)
{
    if (sent) {
        memmove(queue, queue + sent, length - sent);
    }
    length -= sent;
    sent = 0;
    char *bigger = realloc(queue, length + more);
    if (!bigger) {
        fputs("mssfoc twin: out of memory\n", stderr);
        exit(1);
    }
    queue = bigger;
}

static void begin_typing(void)
{
    if (!typing) {
        type_next(NULL);
    }
}

void console_type(const char *text)
{
    size_t more = strlen(text) + 1;
    make_room(more);
    memcpy(queue + length, text, more - 1);
    queue[length + more - 1] = '\r';
    length += more;
    begin_typing();
}

void console_keys(const char *hex)
{
    unsigned byte;
    int digits;
    make_room(strlen(hex) / 2 + 1);
    for (; sscanf(hex, "%2x%n", &byte, &digits) == 1 && digits == 2; hex += digits) {
        queue[length++] = (char)byte;
    }
    if (*hex != '\0') {
        fprintf(stderr, "mssfoc twin: keys: '%s' are no bytes in hexadecimal\n", hex);
        exit(1);
    }
    begin_typing();
}

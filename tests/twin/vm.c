/* SPDX-License-Identifier: GPL-2.0-or-later */
/* QEMU as the CAN bus sees it (qemu_api.h), for tests in Python: time goes on when it is told to. */
#include <string.h>

#include "qemu_api.h"

struct vm_timer {
    void (*expired)(void *);
    int64_t at_ns;
    bool set;
};

struct played {
    int64_t now_ns;
    struct vm_timer timers[4];
    unsigned timer_count;
    const struct vm_region *mapped;
    char sent[4096];
    int (*room)(void *);
    void (*hears)(void *, const uint8_t *, int);
    void (*changes)(void *, int);
};

struct played vm_played;

int64_t vm_now_ns(void)
{
    return vm_played.now_ns;
}

struct vm_timer *vm_timer_new(void (*expired)(void *), void *context)
{
    (void)context;
    vm_played.timers[vm_played.timer_count].expired = expired;
    return &vm_played.timers[vm_played.timer_count++];
}

void vm_timer_at(struct vm_timer *timer, int64_t when_ns)
{
    timer->at_ns = when_ns;
    timer->set = true;
}

void vm_timer_stop(struct vm_timer *timer)
{
    timer->set = false;
}

void vm_set_interrupt(int number, bool level)
{
    (void)number;
    (void)level;
}

void vm_map(const struct vm_region *region)
{
    vm_played.mapped = region;
}

struct vm_chardev *vm_chardev_open(const char *id, int (*room)(void *), void (*hear)(void *, const uint8_t *, int),
                                   void (*changes)(void *, int))
{
    (void)id;
    vm_played.room = room;
    vm_played.hears = hear;
    vm_played.changes = changes;
    changes(NULL, VM_CHARDEV_OPENED); /* as QEMU does for one that is connected already */
    return (struct vm_chardev *)&vm_played;
}

void vm_chardev_send(struct vm_chardev *opened, const void *bytes, size_t count)
{
    (void)opened;
    strncat(vm_played.sent, bytes, count);
}

void vm_played_wait(int64_t for_ns);
void vm_played_wait(int64_t for_ns)
{
    const int64_t until_ns = vm_played.now_ns + for_ns;
    for (;;) {
        struct vm_timer *next = NULL;
        for (struct vm_timer *t = vm_played.timers; t < vm_played.timers + vm_played.timer_count; t++) {
            next = t->set && t->at_ns <= until_ns && (!next || t->at_ns < next->at_ns) ? t : next;
        }
        if (!next) {
            break;
        }
        next->set = false;
        vm_played.now_ns = next->at_ns;
        next->expired(NULL);
    }
    vm_played.now_ns = until_ns;
}

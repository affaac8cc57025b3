/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The CAN controller on a bus that it shares with other twins, QEMU played by this file: what it says and what it hears. */
#include <string.h>

#include "can_bus.c"
#include "can_device.c"
#include "check.h"

#define BIT_NS_500 2000
#define CONFIG_500 (9u << 16 | 15u << 8 | 2u << 5) /* ten clocks a quantum, twenty of these a bit */

/* ---- QEMU ---- */

struct vm_timer {
    void (*expired)(void *);
    int64_t at_ns;
    bool set;
};

static int64_t now_ns;
static struct vm_timer timers[2];
static unsigned timer_count;
static const struct vm_region *mapped;
static char sent[4096];
static int (*ready)(void *);
static void (*hears)(void *, const uint8_t *, int);
static void (*happens)(void *, int);

int64_t vm_now_ns(void)
{
    return now_ns;
}

struct vm_timer *vm_timer_new(void (*expired)(void *), void *unused)
{
    (void)unused;
    timers[timer_count].expired = expired;
    return &timers[timer_count++];
}

void vm_timer_at(struct vm_timer *t, int64_t when_ns)
{
    t->at_ns = when_ns;
    t->set = true;
}

void vm_timer_stop(struct vm_timer *t)
{
    t->set = false;
}

void vm_set_interrupt(int number, bool level)
{
    (void)number;
    (void)level;
}

void vm_map(const struct vm_region *region)
{
    mapped = region;
}

struct vm_chardev *vm_chardev_open(const char *id, int (*may)(void *), void (*listens_to)(void *, const uint8_t *, int),
                                   void (*changes_to)(void *, int))
{
    static int any;
    (void)id;
    ready = may;
    hears = listens_to;
    happens = changes_to;
    happens(NULL, VM_CHARDEV_OPENED); /* as QEMU does for one that is connected already */
    return (struct vm_chardev *)&any;
}

void vm_chardev_send(struct vm_chardev *opened, const void *bytes, size_t count)
{
    (void)opened;
    strncat(sent, bytes, count);
}

/* ---- the others ---- */

static void say_to_it(const char *text)
{
    hears(NULL, (const uint8_t *)text, (int)strlen(text));
}

static void is_said(const char *name, const char *expected)
{
    check_true(name, strcmp(sent, expected) == 0);
    sent[0] = '\0';
}

static void wait_ns(int64_t for_ns)
{
    int64_t until_ns = now_ns + for_ns;
    for (;;) {
        struct vm_timer *next = NULL;
        for (unsigned n = 0; n < timer_count; n++) {
            if (timers[n].set && timers[n].at_ns <= until_ns && (!next || timers[n].at_ns < next->at_ns)) {
                next = &timers[n];
            }
        }
        if (!next) {
            break;
        }
        next->set = false;
        now_ns = next->at_ns;
        next->expired(NULL);
    }
    now_ns = until_ns;
}

static void put(uint32_t offset, uint32_t value)
{
    mapped->write(NULL, offset, value);
}

static void send_frame(uint32_t id)
{
    put(0x24, id << 21);
    put(0x20, 1u << 23 | 1u); /* no data */
}

static unsigned errors(void)
{
    return mapped->read(NULL, 0x10) & 0xFF;
}

static bool waits(void)
{
    return mapped->read(NULL, 0x0C) != 0;
}

static void acknowledge(void)
{
    is_said("it says that it is a twin", "< node 0 0 >");
    put(0x18, CONFIG_500);
    put(0x14, 1);
    is_said("and at what rate it is on the bus", "< node 2000 0 >");
    send_frame(0x705);
    wait_ns(1000000);
    check_true("alone it is not acknowledged", waits() && errors() > 0);
    say_to_it("< hi >< others 1 0 >");
    wait_ns(1000000);
    check_true("another twin acknowledges", !waits());
    check_true("and is told", strstr(sent, "< wire t7050 ") == sent);
    sent[0] = '\0';
}

static void frames_of_others(void)
{
    struct can_frame sync = {.id = 0x080}, late = {.id = 0x705};
    int64_t both_ns = (int64_t)(can_frame_bits(&sync) + can_frame_bits(&late)) * BIT_NS_500;
    say_to_it("< wire t0800 0 >< wire t0800 0 >");
    send_frame(0x705);
    wait_ns(both_ns);
    check_true("frames of others take their bits, the lower goes first", waits());
    wait_ns((int64_t)can_frame_bits(&sync) * BIT_NS_500 - 1);
    check_true("so that a higher one waits for them", waits());
    wait_ns(1);
    check_true("no longer", !waits());
    sent[0] = '\0';
    say_to_it("< wire t7FF0 0 >");
    wait_ns(1000);
    send_frame(0x080);
    wait_ns((int64_t)can_frame_bits(&(struct can_frame){.id = 0x7FF}) * BIT_NS_500);
    check_true("one that is on its way is not broken off", waits());
    wait_ns(1000000);
    check_true("and then it goes", !waits() && strstr(sent, "< wire t0800 "));
    sent[0] = '\0';
}

static void flow(void)
{
    for (int n = 0; n <= (int)QUEUE - SPARE_ROOM; n++) { /* one of them is on its way */
        say_to_it("< wire t0800 0 >");
    }
    check_equal("it hears no more than it has room for", ready(NULL), 0);
    wait_ns(1000000000);
    check_true("room again", ready(NULL) > 0);
}

static void other_rates(void)
{
    say_to_it("< others 1 1 >");
    send_frame(0x705);
    wait_ns(500000);
    check_true("a twin of another rate destroys its frames", waits() && errors() >= 8);
    check_true("of which all hear", strstr(sent, CAN_LINK_NOISE) == sent);
    wait_ns(10000000);
    check_true("until it is off", mapped->read(NULL, 0x10) >> 17 & 1);
    check_true("which it says, and before that that it is passive",
               strstr(sent, "< node 2000 1 >") && strstr(sent, "< node 0 0 >"));
    sent[0] = '\0';
    can_bus_reset();
    put(0x18, CONFIG_500);
    put(0x14, 1);
    sent[0] = '\0';
    say_to_it("< others 1 0 >< noise >");
    check_true("noise is an error that it has heard", (mapped->read(NULL, 0x10) >> 8 & 0xFF) == 1);
}

static void ends(void)
{
    can_bus_cut(true);
    is_said("with a cut cable it is not there", "< node 0 0 >");
    can_bus_cut(false);
    is_said("and back", "< node 2000 0 >");
    happens(NULL, 0);
    send_frame(0x705);
    wait_ns(1000000);
    check_true("when the bus has ended nobody acknowledges", waits());
}

int main(void)
{
    sysreg_design(SYSREG_SOFT_RESET_CR, 0);
    sysreg_reset(RESET_POWER_ON);
    can_bus_map();
    can_bus_open("can", false, NULL);
    for (uint32_t n = 0; n < CAN_MAILBOXES; n++) { /* RAM that holds anything */
        put(0x20 + 16 * n, 0x800008u);
        put(0x220 + 32 * n, 0x800080u);
    }
    acknowledge();
    frames_of_others();
    flow();
    other_rates();
    ends();
    return check_end();
}

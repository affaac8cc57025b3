/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Time, interrupts and reset. */
#include "qemu_api.h"
#include "qemu_sleep.h"
#include "qemu_symbols.h"

#include <stdio.h>
#include <stdlib.h>

#define CLOCK_VIRTUAL     1
#define SCALE_NS          1
#define CAUSE_GUEST_RESET 7 /* SHUTDOWN_CAUSE_GUEST_RESET */

int64_t vm_now_ns(void)
{
    return vm.qemu_clock_get_ns(CLOCK_VIRTUAL);
}

struct vm_timer *vm_timer_new(void (*expired)(void *context), void *context)
{
    struct vm_timer *timer = vm_room(OPAQUE_BYTES);
    vm.timer_init_full(timer, NULL, CLOCK_VIRTUAL, SCALE_NS, 0, expired, context);
    return timer;
}

void vm_timer_at(struct vm_timer *timer, int64_t when_ns)
{
    vm.timer_mod_ns(timer, when_ns);
}

void vm_timer_stop(struct vm_timer *timer)
{
    vm.timer_del(timer);
}

void vm_sleep_alone(void)
{
    if (!vm_sleep_prepare()) {
        fputs(
            "mssfoc twin: the clock of this QEMU is not where it was in 7.2 and 10: the run takes longer, its results "
            "are the same\n",
            stderr);
    }
}

void vm_set_interrupt(int number, bool level)
{
    static opaque *line[128];
    if (!line[number]) {
        line[number] = vm.qdev_get_gpio_in(vm_core(), number);
    }
    vm.qemu_set_irq(line[number], level);
}

void vm_on_reset(void (*reset)(void *context), void *context)
{
    vm.qemu_register_reset(reset, context);
}

static bool reset_is_due;

void vm_stall(int64_t until_ns, void (*over)(int64_t for_ns))
{
    (void)vm_stall_core(vm.qemu_get_cpu(0), until_ns, &reset_is_due, over);
}

static void reset_now(opaque *cpu, uint64_t unused)
{
    (void)cpu;
    (void)unused;
    reset_is_due = false;
    vm.qemu_system_reset(CAUSE_GUEST_RESET);
}

/* QEMU leaves a reset to its main loop, and by then time may have gone on, by an amount that depends on how busy the host
 * is. As work for the core's thread it comes before the next instruction, and before the next timer. */
void vm_request_reset(void)
{
    if (!reset_is_due) {
        reset_is_due = true;
        vm.async_run_on_cpu(vm.qemu_get_cpu(0), reset_now, 0);
    }
}

static void reset_requested_by_guest(void *unused, int line, int level)
{
    (void)unused;
    (void)line;
    if (level) {
        vm_request_reset();
    }
}

void vm_take_over_resets(void)
{
    vm.qdev_connect_gpio_out_named(vm_core(), "SYSRESETREQ", 0,
                                   vm.qemu_allocate_irq(reset_requested_by_guest, NULL, 0));
}

void vm_end(void)
{
    /* A shutdown request would let the guest run on until the main loop gets to it, and print a different number of
     * characters each time. */
    exit(0);
}

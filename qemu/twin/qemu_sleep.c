/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Work is queued for the core before it executes WFI. The core halts, its thread finds the work in place of waiting,
 * and the work does what QEMU's main loop would have done: it moves the clock to the next timer and runs it, until an
 * interrupt wants the core. The big lock is held throughout, no block of instructions is under way.
 *
 * No function of QEMU moves the clock without waking the main loop, so that the bias between counted instructions and
 * the clock is written here. It is a private member of timers_state: prepare() looks for the word that moves the clock
 * as the bias does, and for nothing else. */
#define _GNU_SOURCE
#include "qemu_sleep.h"

#include <dlfcn.h>
#include <link.h>
#include <stddef.h>
#include <stdint.h>

#define CLOCK_VIRTUAL     1
#define NOT_EXTERNAL      (~1) /* ~QEMU_TIMER_ATTR_EXTERNAL: all that the guest can see */
#define NS_PER_COUNT_LOG2 3    /* -icount shift=3 */
#define TRIAL_NS          1024
#define PATIENCE          256 /* timers in a row that do not wake the core */

typedef void opaque;

#define FUNCTIONS(X) \
    X(void, async_run_on_cpu, (opaque *, void (*)(opaque *, uint64_t), uint64_t)) \
    X(bool, cpu_thread_is_idle, (opaque *)) \
    X(int64_t, qemu_clock_deadline_ns_all, (int, int)) \
    X(bool, qemu_clock_run_timers, (int)) \
    X(int64_t, qemu_clock_get_ns, (int)) \
    X(int64_t, icount_get_raw, (void))

#define MEMBER(result, name, parameters) result(*name) parameters;
static struct {
    FUNCTIONS(MEMBER)
} vm;

static int64_t *bias_ns; /* NULL: unknown */
static unsigned in_vain;

static void add_to_bias(int64_t *word, int64_t ns)
{
    __atomic_store_n(word, __atomic_load_n(word, __ATOMIC_RELAXED) + ns, __ATOMIC_RELEASE);
}

static int64_t now_ns(void)
{
    return vm.qemu_clock_get_ns(CLOCK_VIRTUAL);
}

/* The value is known beforehand, so that hardly any other word is touched, and none for longer than one reading of the
 * clock. */
static bool is_bias(int64_t *word)
{
    int64_t before_ns = now_ns();
    if (*word != before_ns - (vm.icount_get_raw() << NS_PER_COUNT_LOG2)) {
        return false;
    }
    add_to_bias(word, TRIAL_NS);
    bool moved = now_ns() == before_ns + TRIAL_NS;
    add_to_bias(word, -TRIAL_NS);
    return moved && now_ns() == before_ns;
}

static int64_t *find_bias(void)
{
    void *state = dlsym(RTLD_DEFAULT, "timers_state");
    const ElfW(Sym) *symbol = NULL;
    Dl_info unused;
    if (!state || !dladdr1(state, &unused, (void **)&symbol, RTLD_DL_SYMENT) || !symbol) {
        return NULL;
    }
    for (size_t at = 0; at + sizeof(int64_t) <= symbol->st_size; at += sizeof(int64_t)) {
        int64_t *word = (int64_t *)((char *)state + at);
        if (is_bias(word)) {
            return word;
        }
    }
    return NULL;
}

bool vm_sleep_prepare(void)
{
    bool complete = true;
#define FIND(result, name, parameters) \
    vm.name = (result(*) parameters)dlsym(RTLD_DEFAULT, #name); \
    complete = complete && vm.name;
    FUNCTIONS(FIND)
    bias_ns = complete ? find_bias() : NULL;
    return bias_ns != NULL;
}

/* One timer further. The next call is queued first: a core with work ahead is not idle, and a timer that another one
 * sets meanwhile does not make QEMU move the clock on its own. A core that nothing wakes is left to the main loop, which
 * would otherwise not get the lock. */
static void sleep_on(opaque *cpu, uint64_t unused)
{
    if (!vm.cpu_thread_is_idle(cpu) || in_vain++ == PATIENCE) {
        return;
    }
    int64_t left_ns = vm.qemu_clock_deadline_ns_all(CLOCK_VIRTUAL, NOT_EXTERNAL);
    if (left_ns < 0) {
        return; /* the clock stands, or nothing is due ever */
    }
    vm.async_run_on_cpu(cpu, sleep_on, unused);
    add_to_bias(bias_ns, left_ns);
    vm.qemu_clock_run_timers(CLOCK_VIRTUAL);
}

void vm_sleep_ahead(void *cpu)
{
    if (bias_ns) {
        in_vain = 0;
        vm.async_run_on_cpu(cpu, sleep_on, 0);
    }
}

/* Of each reason to stand still, which `over` tells, one at a time. */
static struct stall {
    bool queued;
    int64_t until_ns;
    const bool *reset_is_due;
    void (*over)(int64_t for_ns);
} stalls[2];
#define STALLS (sizeof stalls / sizeof stalls[0])

/* Timers have their turn on the way. */
static void stand_still(opaque *cpu, uint64_t which)
{
    struct stall *stall = &stalls[which];
    (void)cpu;
    stall->queued = false;
    int64_t from_ns = now_ns(), left_ns;
    while ((left_ns = stall->until_ns - now_ns()) > 0 && !*stall->reset_is_due) {
        int64_t next_ns = vm.qemu_clock_deadline_ns_all(CLOCK_VIRTUAL, NOT_EXTERNAL);
        add_to_bias(bias_ns, next_ns >= 0 && next_ns < left_ns ? next_ns : left_ns);
        vm.qemu_clock_run_timers(CLOCK_VIRTUAL);
    }
    stall->over(now_ns() - from_ns);
}

/* The place of this reason, or a free one. */
static uint64_t stall_for(void (*over)(int64_t for_ns))
{
    uint64_t free = 0;
    for (uint64_t n = 0; n < STALLS; n++) {
        if (stalls[n].queued && stalls[n].over == over) {
            return n;
        }
        free = stalls[n].queued ? free : n;
    }
    return free;
}

bool vm_stall_core(void *cpu, int64_t until_ns, const bool *reset_is_due, void (*over)(int64_t for_ns))
{
    uint64_t which = stall_for(over);
    if (bias_ns && !stalls[which].queued) {
        stalls[which] = (struct stall){true, until_ns, reset_is_due, over};
        vm.async_run_on_cpu(cpu, stand_still, which);
    }
    return bias_ns != NULL;
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "tests/unit/host/envm.h"

#include <setjmp.h>
#include <string.h>

#include "drivers/cortex/cpu.h"
#include "drivers/mss/envm_bus.h"
#include "drivers/mss/watchdog.h"
#include "firmware/drive/nvm.h"

#define CONTROLLER  0x60080000u
#define ENVM_CR     0x4003800Cu
#define WDOGVALUE   0x40005000u
#define WDOGLOAD    0x40005004u
#define WDOGREFRESH 0x4000500Cu
#define AT_CMD      0x148u
#define AT_STATUS   0x120u

#define ACCESS_PS 100000
#define TICK_PS   20000 /* of the watchdog */

#define WATCHDOG_TICKS 0x6000003Fu /* 32.2 s */

#define LOOKS       20 /* that a command takes */
#define SLOTS_START 0x3C000u
#define SLOT_BYTES  4096u

struct host_bench host_bench;
static jmp_buf power_fails;

static sim_ps step(uintptr_t address)
{
    const struct envm *const e = &host_bench.envm;
    const bool waits = address == CONTROLLER + AT_STATUS && envm_is_busy(e) && !host_bench.watchdog_stands;
    return waits ? ACCESS_PS + (e->until - e->began) / LOOKS : ACCESS_PS;
}

uint32_t host_envm_read(uintptr_t address)
{
    struct host_bench *const b = &host_bench;
    b->now += step(address);
    b->open += envm_is_busy(&b->envm) && host_primask == 0u;
    if (address == ENVM_CR) {
        return b->envm_cr;
    }
    if (address == WDOGLOAD) {
        return b->watchdog_ticks;
    }
    if (address == WDOGVALUE) {
        const uint64_t gone = b->watchdog_stands ? 0 : (uint64_t)((b->now - b->served) / TICK_PS);
        return gone < b->watchdog_ticks ? (uint32_t)(b->watchdog_ticks - gone) : 0u;
    }
    return envm_read(&b->envm, (uint32_t)(address - CONTROLLER), b->now);
}

static void count_command(uint32_t value)
{
    struct host_bench *const b = &host_bench;
    b->commands++;
    b->programs += value >> 24 == 8u;
    b->lit += (b->axis->fabric->gate.STATUS & GATE_STATUS_LIVE) != 0u;
}

void host_envm_write(uintptr_t address, uint32_t value)
{
    struct host_bench *const b = &host_bench;
    b->now += step(address);
    if (address == ENVM_CR) {
        b->envm_cr = value;
        b->envm.wait_states = (value & (0xFFu << 5)) == 0xFFu << 5;
    } else if (address == WDOGREFRESH) {
        const uint64_t late_ms = (uint64_t)((b->now - b->served) / 1000000000);
        b->late_ms = late_ms > b->late_ms ? late_ms : b->late_ms;
        b->served = b->now;
        b->refreshes++;
    } else {
        if (address == CONTROLLER + AT_CMD) {
            count_command(value);
        }
        (void)envm_write(&b->envm, (uint32_t)(address - CONTROLLER), value, b->now);
    }
    b->writes++;
    if (b->writes == b->cut_at) {
        const struct envm *const e = &b->envm;
        b->cut_in_command = envm_is_busy(e);
        const sim_ps on = envm_is_busy(e) ? (sim_ps)((double)(e->until - b->now) * b->cut_share) : 0;
        envm_power_cut(&b->envm, b->now + on);
        longjmp(power_fails, 1);
    }
}

static void millisecond_passes(void)
{
    host_bench.axis->time_ms++;
    host_bench.now += 1000000000;
}

static void power_on(struct axis *a)
{
    host_primask = 0;
    host_basepri = 0;
    host_bench.axis = a;
    host_bench.served = host_bench.now;
    host_on_sleep = millisecond_passes;
}

/* A device that has never stored anything. */
void host_envm_new(struct axis *a, double program_s, uint64_t seed)
{
    const struct envm_params p = {.program_s = program_s, .verify_s = 20e-6, .endurance = 1000};
    memset(&host_bench, 0, sizeof host_bench);
    host_bench.watchdog_ticks = WATCHDOG_TICKS;
    envm_init(&host_bench.envm, &p, seed);
    power_on(a);
}

struct slots host_slots(void)
{
    return (struct slots){host_bench.envm.array + SLOTS_START, SLOTS_START, SLOT_BYTES};
}

/* enum error of a save, or -1: the power has failed behind the write to a register that is number `cut_at` of this save. */
int32_t host_save(struct axis *a, struct saved *report, uint64_t cut_at, double cut_share)
{
    const struct slots s = host_slots();
    power_on(a);
    host_bench.writes = 0;
    host_bench.cut_at = cut_at;
    host_bench.cut_share = cut_share;
    if (setjmp(power_fails) != 0) {
        host_primask = 0;
        host_basepri = 0;
        return -1;
    }
    return (int32_t)drive_save(a, &s, report).error;
}

/* SPDX-License-Identifier: MIT */
#include "drivers/mss/envm.h"

#include "drivers/cortex/cpu.h"
#include "drivers/mss/envm_bus.h"
#include "drivers/mss/sysreg.h"
#include "drivers/mss/watchdog.h"

/* Nothing here may call what is not here, or read a constant that the compiler puts elsewhere: tests/image looks. */
#define IN_ESRAM __attribute__((section(".ramcode"), noinline))

#define GRANT_LOOKS    1000u
#define WAIT_LOOKS     1000000u                          /* of at least 10 cycles each */
#define PATIENCE_TICKS (BOARD_WATCHDOG_HZ / 1000u * 66u) /* 66 ms, for program and verify together */

static IN_ESRAM bool is_granted(void)
{
    envm_bus_write(&ENVM->REQ_ACCESS, ENVM_ACCESS_ASK);
    for (uint32_t look = 0; look < GRANT_LOOKS; look++) {
        if (envm_bus_read(&ENVM->REQ_ACCESS) == ENVM_ACCESS_GRANTED) {
            return true;
        }
    }
    return false;
}

static IN_ESRAM enum envm_result result_of(uint32_t status)
{
    if ((status & ENVM_STATUS_ACCESS_DENIED) != 0u) {
        return ENVM_DENIED;
    }
    if ((status & ENVM_STATUS_BUSY_ERROR) != 0u) {
        return ENVM_BUSY;
    }
    if ((status & ENVM_STATUS_REFUSED) != 0u) {
        return ENVM_LOCKED;
    }
    if ((status & ENVM_STATUS_ERASE_ERROR) != 0u) {
        return ENVM_ERASE_FAILED;
    }
    if ((status & ENVM_STATUS_WRITE_ERROR) != 0u) {
        return ENVM_WRITE_FAILED;
    }
    if ((status & ENVM_STATUS_VERIFY_ERROR) != 0u) {
        return ENVM_VERIFY_FAILED;
    }
    return (status & ENVM_STATUS_WORN) != 0u ? ENVM_WORN : ENVM_DONE;
}

/* What the watchdog shows when it is time to give up: after two thirds of its time-out, but no later than PATIENCE_TICKS. */
static IN_ESRAM uint32_t ticks_left_least(void)
{
    const uint32_t load = envm_bus_read(&WATCHDOG->WDOGLOAD);
    const uint32_t third = load / 3u;
    return third < PATIENCE_TICKS / 2u ? third : load - PATIENCE_TICKS;
}

/* "Ready" counts when two looks in a row see it: the vendor's driver works around an erratum so. */
static IN_ESRAM enum envm_result command(uint32_t code)
{
    const uint32_t least = ticks_left_least();
    uint32_t before = 0;
    envm_bus_write(&ENVM->CMD, code);
    for (uint32_t look = 0; look < WAIT_LOOKS; look++) {
        const uint32_t status = envm_bus_read(&ENVM->STATUS);
        if ((status & before & ENVM_STATUS_READY) != 0u) {
            return result_of(status);
        }
        before = status;
        if (envm_bus_read(&WATCHDOG->WDOGVALUE) < least) {
            break;
        }
    }
    return ENVM_TIMED_OUT;
}

static IN_ESRAM enum envm_result program_and_verify(uint32_t offset_bytes, const uint32_t *words)
{
    if (!is_granted()) {
        return ENVM_NOT_GRANTED;
    }
    envm_bus_write(&ENVM->CLRHINT, ENVM_CLRHINT_ACCESS_DENIED | ENVM_CLRHINT_BUSY_ERROR);
    envm_bus_write(&ENVM->PAGE_LOCK, 0u);
    for (uint32_t n = 0; n < ENVM_PAGE_WORDS; n++) {
        envm_bus_write(&ENVM->WD[n], words[n]);
    }
    const enum envm_result programmed = command(ENVM_CMD_PROGRAM | offset_bytes);
    if (programmed > ENVM_WORN) {
        return programmed;
    }
    const enum envm_result verified = command(ENVM_CMD_VERIFY | offset_bytes);
    return verified > ENVM_WORN ? verified : programmed;
}

static IN_ESRAM enum envm_result with_wait_states(uint32_t offset_bytes, const uint32_t *words)
{
    const uint32_t as_designed = envm_bus_read(&SYSREG->ENVM_CR);
    envm_bus_write(&SYSREG->ENVM_CR, as_designed | ENVM_CR_FREQRNG);
    const enum envm_result result = program_and_verify(offset_bytes, words);
    envm_bus_write(&ENVM->REQ_ACCESS, 0u);
    envm_bus_write(&SYSREG->ENVM_CR, as_designed);
    return result;
}

enum envm_result envm_program_page(uint32_t offset_bytes, const uint32_t words[ENVM_PAGE_WORDS])
{
    const uint32_t mask = cpu_irq_save();
    envm_bus_write(&WATCHDOG->WDOGREFRESH, WATCHDOG_REFRESH_KEY);
    const enum envm_result result = with_wait_states(offset_bytes, words);
    cpu_irq_restore(mask);
    return result;
}

/* SPDX-License-Identifier: MIT */
/* The eNVM's controller: a page programmed from eSRAM, what is read back, and who waits for it. */
#include "drivers/mss/envm.h"
#include "drivers/mss/sysreg.h"
#include "drivers/mss/watchdog.h"
#include "startup/startup.h"
#include "tests/target/harness.h"

#define FREQRNG   (0xFFu << 5)
#define DESIGN_CR (0x7u << 5)

static uint32_t offset_of_slots(void)
{
    return (uint32_t)(uintptr_t)link_settings_start - ENVM_ARRAY;
}

/* By the array's own address, or where the core executes. */
static uint32_t word_at(uint32_t base, uint32_t offset_bytes, uint32_t word)
{
    return *REG_BLOCK(const volatile uint32_t, base + offset_bytes + 4u * word);
}

static void fill(uint32_t words[ENVM_PAGE_WORDS], uint32_t seed)
{
    for (uint32_t n = 0; n < ENVM_PAGE_WORDS; n++) {
        words[n] = seed * (n + 1u);
    }
}

static bool holds(uint32_t base, uint32_t offset_bytes, const uint32_t words[ENVM_PAGE_WORDS])
{
    for (uint32_t n = 0; n < ENVM_PAGE_WORDS; n++) {
        if (word_at(base, offset_bytes, n) != words[n]) {
            return false;
        }
    }
    return true;
}

static uint32_t watchdog_us(void)
{
    return (watchdog_timeout_ticks() - watchdog_remaining_ticks()) / (BOARD_WATCHDOG_HZ / 1000000u);
}

static void test_a_page(void)
{
    uint32_t words[ENVM_PAGE_WORDS];
    const uint32_t page = offset_of_slots() + 3u * ENVM_PAGE_BYTES;
    const uint32_t next = word_at(ENVM_ARRAY, page + ENVM_PAGE_BYTES, 0);
    SYSREG->ENVM_CR = DESIGN_CR;
    fill(words, 0x01234567u);
    const enum envm_result result = envm_program_page(page, words);
    const uint32_t us = watchdog_us(); /* a check refreshes the watchdog */
    harness_equal("envm: a page", result, ENVM_DONE);
    harness_between("envm: it took the time of a page, us", us, 7900u, 9000u);
    harness_true("envm: reads back", holds(ENVM_ARRAY, page, words));
    harness_true("envm: and where code is", holds(0u, page, words));
    harness_equal("envm: the page behind it is as it was", word_at(ENVM_ARRAY, page + ENVM_PAGE_BYTES, 0), next);
    harness_equal("envm: wait states as they were", SYSREG->ENVM_CR, DESIGN_CR);
    harness_equal("envm: access given back", ENVM->REQ_ACCESS, 0u);
    fill(words, 0x89ABCDEFu);
    harness_equal("envm: over what it had", envm_program_page(page, words), ENVM_DONE);
    harness_true("envm: reads back again", holds(ENVM_ARRAY, page, words));
    harness_equal("envm: a page of the device's", envm_program_page(0x3F800u, words), ENVM_DENIED);
    uint32_t primask;
    __asm volatile("mrs %0, primask" : "=r"(primask));
    harness_equal("envm: interrupts as they were", primask, 0u);
}

static void ask(uint32_t command, uint32_t page)
{
    SYSREG->ENVM_CR = DESIGN_CR | FREQRNG;
    ENVM->REQ_ACCESS = ENVM_ACCESS_ASK;
    ENVM->CLRHINT = ENVM_CLRHINT_ACCESS_DENIED | ENVM_CLRHINT_BUSY_ERROR; /* what test_a_page() was denied */
    watchdog_refresh();
    ENVM->CMD = command | page;
}

/* This function lies in eNVM: its next instructions come when the page is programmed, but for one that is fetched already. */
static void test_who_waits(void)
{
    const uint32_t page = offset_of_slots() + 4u * ENVM_PAGE_BYTES;
    ask(ENVM_CMD_PROGRAM, page);
    (void)watchdog_us();
    const uint32_t us = watchdog_us();
    harness_between("envm: code in eNVM has waited, us", us, 7900u, 8100u);
    harness_equal("envm: and finds it done", ENVM->STATUS & ENVM_STATUS_READY, ENVM_STATUS_READY);
    ENVM->REQ_ACCESS = 0u;
    watchdog_refresh();
    ENVM->CMD = ENVM_CMD_PROGRAM | page;
    harness_between("envm: without access nothing begins, us", watchdog_us(), 0u, 300u);
}

int main(void)
{
    harness_begin();
    test_a_page();
    test_who_waits();
    harness_end();
}

/* SPDX-License-Identifier: MIT */
/*
 * A page of the eNVM is programmed, and once more by hand, to see what happens meanwhile: B14. Two of its 1000 writes a run.
 *
 * It is the last page below the settings of both axes: in the region of images, which flashing erases anyway; this one does not
 * reach so far, and no settings, certificates or protected pages are there, on any device that has 256 KB.
 */
#include "drivers/bringup/bringup.h"
#include "drivers/cortex/cpu.h"
#include "drivers/mss/timer.h"
#include "startup/startup.h"

#define IN_ESRAM     __attribute__((section(".ramcode"), noinline))
#define TICKS_PER_US (BOARD_MSS_TIMER_HZ / 1000000u)
#define GRANT_LOOKS  1000u
#define READY_TICKS  (66000u * TICKS_PER_US)

struct meanwhile {
    uint32_t load_ticks, busy, cleared, page_status, status;
};

static uint32_t spare_page(void)
{
    const uint32_t of_an_axis = (uint32_t)((uintptr_t)link_settings_end - (uintptr_t)link_settings_start);
    return (uint32_t)(uintptr_t)link_settings_start - of_an_axis - ENVM_ARRAY - ENVM_PAGE_BYTES;
}

static IN_ESRAM bool controller_is_ours(void)
{
    ENVM->REQ_ACCESS = ENVM_ACCESS_ASK;
    for (uint32_t look = 0; look < GRANT_LOOKS; look++) {
        if (ENVM->REQ_ACCESS == ENVM_ACCESS_GRANTED) {
            return true;
        }
    }
    return false;
}

static IN_ESRAM void wait_until_ready(void)
{
    const uint32_t start = mss_timer2_now();
    uint32_t before = 0;
    while (mss_timer2_now() - start < READY_TICKS) {
        const uint32_t status = ENVM->STATUS;
        if ((status & before & ENVM_STATUS_READY) != 0u) {
            return;
        }
        before = status;
    }
}

/* The second command is refused, and the load waits for the first to end. */
static IN_ESRAM void look_meanwhile(uint32_t page, struct meanwhile *m)
{
    const uint32_t start = mss_timer2_now();
    ENVM->CMD = ENVM_CMD_PROGRAM | page;
    ENVM->CMD = ENVM_CMD_VERIFY | page;
    m->busy = ENVM->STATUS & ENVM_STATUS_BUSY_ERROR;
    (void)*REG_BLOCK(const volatile uint32_t, ENVM_ARRAY + page);
    cpu_dsb();
    cpu_isb();
    m->load_ticks = mss_timer2_now() - start;
    wait_until_ready();
    ENVM->CLRHINT = ENVM_CLRHINT_ACCESS_DENIED | ENVM_CLRHINT_BUSY_ERROR;
    m->status = ENVM->STATUS;
    m->cleared = m->status & ENVM_STATUS_BUSY_ERROR;
    m->page_status = ENVM->NV_PAGE_STATUS;
}

static IN_ESRAM void program_by_hand(uint32_t page, struct meanwhile *m)
{
    const uint32_t as_designed = SYSREG->ENVM_CR;
    SYSREG->ENVM_CR = as_designed | ENVM_CR_FREQRNG;
    if (controller_is_ours()) {
        ENVM->CLRHINT = ENVM_CLRHINT_ACCESS_DENIED | ENVM_CLRHINT_BUSY_ERROR;
        ENVM->PAGE_LOCK = 0u;
        for (uint32_t n = 0; n < ENVM_PAGE_WORDS; n++) {
            ENVM->WD[n] = n;
        }
        look_meanwhile(page, m);
    }
    ENVM->REQ_ACCESS = 0u;
    SYSREG->ENVM_CR = as_designed;
}

/* As the drive does it, and what the core then reads. */
static uint32_t program(uint32_t page)
{
    uint32_t words[ENVM_PAGE_WORDS];
    for (uint32_t n = 0; n < ENVM_PAGE_WORDS; n++) {
        words[n] = ~n;
    }
    const enum envm_result result = envm_program_page(page, words);
    for (uint32_t n = 0; n < ENVM_PAGE_WORDS && result <= ENVM_WORN; n++) {
        if (REG_BLOCK(const volatile uint32_t, ENVM_ARRAY + page)[n] != words[n]) {
            return ENVM_VERIFY_FAILED;
        }
    }
    return result;
}

void step_envm(struct bringup *b)
{
    struct meanwhile meanwhile = {0};
    const uint32_t page = spare_page(), start = mss_timer2_now();
    const uint32_t result = program(page), ticks = mss_timer2_now() - start;
    program_by_hand(page, &meanwhile);
    report(b, FACT_ENVM_NO_ACCESS, b->found.envm_status);
    report(b, FACT_ENVM_RESULT, result);
    report(b, FACT_ENVM_TIME, ticks / TICKS_PER_US);
    report(b, FACT_ENVM_LOAD_WAITS, meanwhile.load_ticks / TICKS_PER_US);
    report(b, FACT_ENVM_BUSY_ERROR, meanwhile.busy);
    report(b, FACT_ENVM_BUSY_CLEARED, meanwhile.cleared);
    report(b, FACT_ENVM_PAGE_STATUS, meanwhile.page_status);
    report(b, FACT_ENVM_WEAR, meanwhile.status & ENVM_STATUS_WORN);
}

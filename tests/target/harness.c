/* SPDX-License-Identifier: MIT */
/*
 * The console is written by polling, character by character: tests of the UART driver own its interrupt, and a line
 * that is out is out, whatever the next test breaks.
 */
#include "tests/target/harness.h"

#include "drivers/cortex/scb.h"
#include "drivers/mss/mmuart.h"
#include "drivers/mss/sysreg.h"
#include "drivers/mss/watchdog.h"
#include "startup/startup.h"

#define HARNESS_MAGIC 0x74737431u
#define HARNESS_BAUD  115200u
#define HARNESS_POLLS 1000000u

static STARTUP_NOINIT struct {
    uint32_t magic;
    uint32_t passed, failed;
    uint32_t stage;
    uint32_t cause;
    bool reset_announced, fault_expected, nest_fault;
    struct harness_fault fault;
} results;

static void put(char character)
{
    for (uint32_t poll = 0; poll < HARNESS_POLLS; poll++) {
        if ((MMUART0->LSR & MMUART_LSR_THRE) != 0u) {
            MMUART0->THR = (uint8_t)character;
            return;
        }
    }
}

static void put_text(const char *text)
{
    for (; *text != '\0'; text++) {
        put(*text);
    }
}

static void put_decimal(uint32_t value)
{
    char digits[10];
    uint32_t count = 0;
    do {
        digits[count++] = (char)('0' + value % 10u);
        value /= 10u;
    } while (value != 0u);
    while (count > 0u) {
        put(digits[--count]);
    }
}

/* Decimal, and hexadecimal where that is easier to read. */
static void put_number(uint32_t value)
{
    put_decimal(value);
    if (value > 9u) {
        put_text(" (0x");
        for (uint32_t shift = 32; shift > 0u; shift -= 4u) {
            put("0123456789ABCDEF"[(value >> (shift - 4u)) & 15u]);
        }
        put(')');
    }
}

static void put_passed(const char *name)
{
    results.passed++;
    put_text("ok ");
    put_text(name);
    put('\n');
}

static void put_failed(const char *name)
{
    results.failed++;
    put_text("FAIL ");
    put_text(name);
    put_text(": expected ");
}

static void put_got(uint32_t actual)
{
    put_text(" got ");
    put_number(actual);
    put('\n');
}

uint32_t harness_begin(void)
{
    static struct mmuart console;
    watchdog_refresh();
    (void)mmuart_init(&console, MMUART0, HARNESS_BAUD);
    if (results.magic != HARNESS_MAGIC) {
        results.magic = HARNESS_MAGIC;
        results.passed = 0u;
        results.failed = 0u;
        results.stage = 0u;
    } else if (!results.reset_announced) {
        put_failed("no reset out of the blue");
        put_text("none");
        put_got(sysreg_reset_cause());
        harness_end();
    }
    results.cause = sysreg_reset_cause();
    results.reset_announced = false;
    results.fault_expected = false;
    results.nest_fault = false;
    return results.stage;
}

uint32_t harness_reset_cause(void)
{
    return results.cause;
}

void harness_next_stage(uint32_t stage)
{
    results.stage = stage;
    results.reset_announced = true;
}

void harness_expect_fault(uint32_t stage, bool nested)
{
    results.stage = stage;
    results.fault_expected = true;
    results.nest_fault = nested;
}

const struct harness_fault *harness_last_fault(void)
{
    return &results.fault;
}

/* Uses as much of the fault stack as a handler with something to do would, above a second frame as below a first. */
static __attribute__((noinline)) void use_stack(void)
{
    volatile uint32_t words[32];
    for (uint32_t i = 0; i < 32u; i++) {
        words[i] = 0xDEADBEEFu;
    }
    (void)words[0];
}

void fault_taken(const struct fault_frame *frame, uint32_t exc_return)
{
    use_stack();
    const struct scb_fault_status status = scb_take_fault_status();
    results.fault = (struct harness_fault){
        .exception = startup_exception_number(),
        .exc_return = exc_return,
        .cfsr = status.cfsr,
        .hfsr = status.hfsr,
        .mmfar = status.mmfar,
        .bfar = status.bfar,
        .frame_valid = frame != NULL,
    };
    if (frame != NULL) {
        results.fault.frame_address = (uint32_t)(uintptr_t)frame;
        results.fault.pc = frame->pc;
        results.fault.lr = frame->lr;
        results.fault.xpsr = frame->xpsr;
    }
    if (results.nest_fault) {
        results.nest_fault = false;
        __asm volatile("udf #1");
    }
    if (results.fault_expected) {
        results.reset_announced = true;
        scb_system_reset();
    }
    put_failed("no fault");
    put_text("none");
    put_got(results.fault.exception);
    harness_note("cfsr", status.cfsr);
    harness_note("pc", results.fault.pc);
    harness_end();
}

bool harness_true(const char *name, bool condition)
{
    return harness_equal(name, condition ? 1u : 0u, 1u);
}

bool harness_equal(const char *name, uint32_t actual, uint32_t expected)
{
    watchdog_refresh();
    if (actual == expected) {
        put_passed(name);
        return true;
    }
    put_failed(name);
    put_number(expected);
    put_got(actual);
    return false;
}

bool harness_between(const char *name, uint32_t actual, uint32_t low, uint32_t high)
{
    watchdog_refresh();
    if (low <= actual && actual <= high) {
        put_passed(name);
        return true;
    }
    put_failed(name);
    put_number(low);
    put_text("...");
    put_number(high);
    put_got(actual);
    return false;
}

void harness_note(const char *name, uint32_t value)
{
    put_text("# ");
    put_text(name);
    put(' ');
    put_decimal(value);
    put('\n');
}

_Noreturn void harness_end(void)
{
    put_decimal(results.passed);
    put_text(" passed, ");
    put_decimal(results.failed);
    put_text(" failed\n");
    results.magic = 0u; /* a reset from here on starts all over */
    for (;;) {
        watchdog_refresh();
    }
}

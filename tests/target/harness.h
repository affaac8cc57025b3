/* SPDX-License-Identifier: MIT */
/*
 * A test image's ears and mouth. A test image is linked like the firmware, runs on the target, prints one line a check
 *
 *     ok NAME
 *     FAIL NAME: expected X got Y
 *
 * on MMUART_0 and, as its last line, "N passed, N failed". Whoever started it watches for that line and the time.
 *
 *     int main(void)
 *     {
 *         harness_begin();
 *         harness_equal("adding", 2u + 2u, 4u);
 *         harness_end();
 *     }
 *
 * Results live in .noinit, so a test may reset the device and go on: harness_next_stage() before the reset, and
 * main() continues by harness_begin()'s return value. A reset nobody announced is reported as a failure.
 */
#ifndef TESTS_TARGET_HARNESS_H
#define TESTS_TARGET_HARNESS_H

#include <stdbool.h>
#include <stdint.h>

/*
 * Prepares the console and takes the reset cause; returns the stage, 0 at first. Refreshes the watchdog, as every check
 * does: what lies between two checks must take less than its time-out.
 */
uint32_t harness_begin(void);

/* SYSREG_CAUSE_* bits of the reset this stage began with. */
uint32_t harness_reset_cause(void);

/* Announces the reset that is to follow, and the stage that is to run after it. */
void harness_next_stage(uint32_t stage);

/*
 * The next fault is what the test wants: it is recorded, the device is reset, and `stage` follows. Any other fault
 * fails the test and ends the image. `nested`: the fault handler causes a second fault, and that one is recorded.
 */
void harness_expect_fault(uint32_t stage, bool nested);

struct harness_fault {
    uint32_t exception;
    uint32_t exc_return;
    uint32_t cfsr, hfsr, mmfar, bfar;
    bool frame_valid;
    uint32_t frame_address, pc, lr, xpsr; /* of the frame, if it is valid */
};

/* The last fault that was expected. */
const struct harness_fault *harness_last_fault(void);

/* Checks. Each prints its line; they return whether the check passed. */
bool harness_true(const char *name, bool condition);
bool harness_equal(const char *name, uint32_t actual, uint32_t expected);
bool harness_between(const char *name, uint32_t actual, uint32_t low, uint32_t high);

/* A line of information that is no check: "# NAME VALUE". */
void harness_note(const char *name, uint32_t value);

/* Prints the closing line, and then does nothing for good but keep the watchdog quiet. */
_Noreturn void harness_end(void);

#endif

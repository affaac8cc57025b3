/* SPDX-License-Identifier: MIT */
/*
 * The functions of Lib.h called by the thread and by an interrupt that comes at any instruction of them: each with data of its
 * own, whose results are known from the portable definition. 100 000 interruptions; counted where they hit.
 */
#include "drivers/cortex/systick.h"
#include "drivers/mss/watchdog.h"
#include "tests/target/harness.h"
#include "tests/target/lib_cases.h"

#define INTERRUPTIONS 100000u
#define KNOWN         16u  /* vectors of each context */
#define LEAST_HITS    500u /* interruptions inside each function, of a context that does little else */
#define PERIOD_MIN    600u /* core clocks: leaves the thread room between two interruptions */
#define BX_LR         0x4770u

static const lib_function functions[CASE_COUNT] = LIB_FUNCTIONS();

struct known {
    struct lib_vector in;
    struct lib_result out[CASE_COUNT];
};

static struct known thread_known[KNOWN], interrupt_known[KNOWN];
static volatile uint32_t interruptions, interrupt_wrong, hits[CASE_COUNT];
static uint32_t first[CASE_COUNT], last[CASE_COUNT]; /* of each function's code */

void nested_interrupt(const uint32_t *frame);

static void prepare(struct known *known, uint32_t seed)
{
    for (uint32_t n = 0; n < KNOWN; n++) {
        known[n].in = lib_case_vector(LIB_CASE_CORNERS, &seed);
        for (uint32_t which = 0; which < CASE_COUNT; which++) {
            known[n].out[which] = lib_case_expected((enum lib_case)which, &known[n].in, LIB_TRIG_FRAC);
        }
    }
}

/* Calls one function, and says whether its result is wrong. */
static bool wrong(const struct known *known, uint32_t which)
{
    struct lib_result got = {{0, 0, 0}};

    functions[which](known->in.in, got.out);
    const struct lib_result *const expected = &known->out[which];

    return got.out[0] != expected->out[0] || got.out[1] != expected->out[1] || got.out[2] != expected->out[2];
}

/* Its return is the last instruction of a function in Lib_thumb2.S, and the only one of this encoding. */
static uint32_t end_of(uint32_t start)
{
    const uint16_t *code = (const uint16_t *)(uintptr_t)start;

    while (*code != BX_LR) {
        code++;
    }
    return (uint32_t)(uintptr_t)code;
}

void nested_interrupt(const uint32_t *frame)
{
    const uint32_t pc = frame[6];
    const uint32_t number = interruptions;

    for (uint32_t which = 0; which < CASE_COUNT; which++) {
        if (first[which] < pc && pc <= last[which]) { /* behind the first instruction, the return still to come */
            hits[which]++;
        }
        if (wrong(&interrupt_known[number % KNOWN], which)) {
            interrupt_wrong++;
        }
    }
    SYSTICK->RVR = PERIOD_MIN + (number * 7u) % 101u; /* so that every instruction has its turn */
    interruptions = number + 1u;
}

__attribute__((naked)) void SysTick_Handler(void);
__attribute__((naked)) void SysTick_Handler(void)
{
    __asm volatile("mrs r0, msp\n\tb nested_interrupt");
}

static void locate(void)
{
    for (uint32_t which = 0; which < CASE_COUNT; which++) {
        first[which] = (uint32_t)(uintptr_t)functions[which] & ~1u;
        last[which] = end_of(first[which]);
    }
}

int main(void)
{
    static const char *const names[CASE_COUNT] = {"interrupted inside Clarke", "interrupted inside InvClarke",
                                                  "interrupted inside Park", "interrupted inside InvPark"};
    uint32_t thread_wrong = 0u;

    (void)harness_begin();
    locate();
    prepare(thread_known, 1u);
    prepare(interrupt_known, 2u);
    harness_true("SysTick starts", systick_start_periodic(PERIOD_MIN));
    for (uint32_t n = 0; interruptions < INTERRUPTIONS; n++) {
        for (uint32_t which = 0; which < CASE_COUNT; which++) {
            thread_wrong += wrong(&thread_known[n % KNOWN], which) ? 1u : 0u;
        }
        if (n % 256u == 0u) {
            watchdog_refresh();
        }
    }
    systick_stop();
    harness_equal("interruptions", interruptions, INTERRUPTIONS);
    harness_equal("wrong results in the thread", thread_wrong, 0u);
    harness_equal("wrong results in the interrupt", interrupt_wrong, 0u);
    for (uint32_t which = 0; which < CASE_COUNT; which++) {
        harness_note(names[which], hits[which]);
        harness_between(names[which], hits[which], LEAST_HITS, INTERRUPTIONS);
    }
    harness_end();
}

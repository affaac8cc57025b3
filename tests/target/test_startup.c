/* SPDX-License-Identifier: MIT */
/*
 * Reset and the fault entry: what memory looks like when main() starts, what outlives a reset, and that every kind of
 * fault, including a stack overflow, arrives in fault_taken() with the truth about where it happened.
 */
#include "drivers/cortex/mpu.h"
#include "drivers/cortex/nvic.h"
#include "drivers/cortex/scb.h"
#include "drivers/mss/sysreg.h"
#include "startup/startup.h"
#include "tests/target/harness.h"

#define DATA_VALUE 0x1234ABCDu
#define KEPT_VALUE 0x5EED5EEDu
#define NO_MEMORY  0x20020000u /* above eSRAM, nothing there */

extern uint32_t link_bss_end[];

static volatile uint32_t in_data = DATA_VALUE;
static volatile uint32_t in_bss;
extern const uint32_t vectors[];
static STARTUP_NOINIT volatile uint32_t kept;

enum stage {
    POWER_ON,
    AFTER_SOFT_RESET,
    AFTER_GUARD_WRITE,
    AFTER_OVERFLOW,
    AFTER_STACK_IN_GUARD,
    AFTER_UNHANDLED,
    AFTER_UNDEFINED,
    AFTER_BUS_FAULT,
    AFTER_DIVISION,
    AFTER_NESTED,
};

static uint32_t guard_last_word(void)
{
    return (uint32_t)(uintptr_t)link_stack_limit - 4u;
}

/* RAM nobody owns, between .bss and the vectors. */
static uint32_t free_words_other_than(uint32_t value)
{
    const volatile uint32_t *const end = (const volatile uint32_t *)(uintptr_t)startup_vectors;
    uint32_t count = 0;
    for (const volatile uint32_t *word = link_bss_end; word < end; word++) {
        count += *word != value ? 1u : 0u;
    }
    return count;
}

static void dirty_everything(void)
{
    for (volatile uint32_t *word = link_bss_end; word < link_noinit_start; word++) {
        *word = 0xDEADBEEFu;
    }
    in_data = 0xDEADBEEFu;
    in_bss = 0xDEADBEEFu;
    kept = KEPT_VALUE;
}

static uint32_t vectors_other_than_in_flash(void)
{
    const volatile uint32_t *const flash = (const volatile uint32_t *)(uintptr_t)vectors;
    const volatile uint32_t *const used = (const volatile uint32_t *)(uintptr_t)startup_vectors;
    uint32_t count = 0;
    for (uint32_t n = 0; n < STARTUP_SYSTEM_VECTORS + STARTUP_EXTERNAL_VECTORS; n++) {
        count += used[n] != flash[n] ? 1u : 0u;
    }
    return count;
}

static void check_memory(void)
{
    harness_equal("startup: .data has its initial value", in_data, DATA_VALUE);
    harness_equal("startup: .bss is zero", in_bss, 0u);
    harness_equal("startup: free RAM is zero", free_words_other_than(0u), 0u);
    harness_equal("startup: the core takes vectors from RAM", SCB->VTOR, (uint32_t)(uintptr_t)startup_vectors);
    harness_equal("startup: where they are those in flash", vectors_other_than_in_flash(), 0u);
    const uint32_t stack_bytes = (uint32_t)(uintptr_t)link_stack_top - (uint32_t)(uintptr_t)link_stack_limit;
    harness_between("startup: stack is painted, and in use", (uint32_t)startup_stack_unused_bytes(), stack_bytes - 512u,
                    stack_bytes - 8u);
}

static void power_on(void)
{
    harness_equal("startup: power-on sets every cause", harness_reset_cause(), SYSREG_CAUSE_ALL);
    check_memory();
    harness_equal("startup: .noinit is zero after power-on", kept, 0u);
    harness_true("startup: frames are 8-byte aligned", (SCB->CCR & SCB_CCR_STKALIGN) != 0u);
    dirty_everything();
    harness_next_stage(AFTER_SOFT_RESET);
    scb_system_reset();
}

static void guard_on(void)
{
    const uint32_t base = (uint32_t)(uintptr_t)link_stack_guard_start;
    const uint32_t size = (uint32_t)(uintptr_t)link_stack_limit - base;
    scb_enable_faults();
    harness_true("mpu: refuses a size that is no power of two", !mpu_guard_stack(base, size - 4u));
    harness_true("mpu: refuses a size below 32", !mpu_guard_stack(base, 16u));
    harness_true("mpu: refuses a base off its size", !mpu_guard_stack(base + 32u, size));
    MPU->RNR = MPU_GUARD_REGION - 1u; /* as somebody else may have left it */
    harness_true("mpu: guard on", mpu_guard_stack(base, size));
    MPU->RNR = MPU_GUARD_REGION - 1u;
    harness_equal("mpu: the region before it is not touched", MPU->RBAR & MPU_RBAR_ADDR, 0u);
    harness_true("mpu: and reads back, whatever region was selected", mpu_guards(base, size));
}

static void after_soft_reset(void)
{
    harness_equal("startup: cause is soft reset", harness_reset_cause(), SYSREG_CAUSE_SOFT);
    check_memory();
    harness_equal("startup: .noinit is kept", kept, KEPT_VALUE);

    guard_on();
    *(volatile uint32_t *)link_stack_limit = STARTUP_STACK_PAINT;
    harness_true("mpu: the word above the guard is accessible", true);
    harness_expect_fault(AFTER_GUARD_WRITE, false);
    *(volatile uint32_t *)guard_last_word() = 1u;
    harness_true("mpu: a write to the guard faults", false);
    harness_end();
}

static void check_fault(const char *name, uint32_t exception, uint32_t cfsr)
{
    harness_equal(name, harness_last_fault()->exception, exception);
    harness_equal("fault: CFSR", harness_last_fault()->cfsr, cfsr);
}

static uint32_t code_at(uint32_t address)
{
    return *(const volatile uint16_t *)(uintptr_t)address;
}

/* The frame lies on the main stack and its pc in this image's code. */
static void check_frame(void)
{
    const struct harness_fault *fault = harness_last_fault();
    harness_true("fault: frame is valid", fault->frame_valid);
    harness_between("fault: frame on the main stack", fault->frame_address, (uint32_t)(uintptr_t)link_stack_limit,
                    (uint32_t)(uintptr_t)link_stack_top - (uint32_t)sizeof(struct fault_frame));
    harness_between("fault: pc in the code", fault->pc, 4u * 98u, 254u * 1024u);
    harness_equal("fault: return to thread mode, main stack", fault->exc_return, 0xFFFFFFF9u);
}

static volatile uint32_t depth_limit = UINT32_MAX;

/* Uses more stack a level than it leaves to the compiler to optimise away. */
static __attribute__((noinline)) uint32_t recurse(uint32_t depth)
{
    volatile uint32_t room[8];
    room[depth % 8u] = depth;
    return depth < depth_limit ? recurse(depth + 1u) + room[depth % 8u] : room[0];
}

static void after_guard_write(void)
{
    check_fault("fault: write to the guard is a MemManage fault", SCB_EXCEPTION_MEMMANAGE,
                SCB_CFSR_DACCVIOL | SCB_CFSR_MMARVALID);
    harness_equal("fault: MMFAR is the guard's last word", harness_last_fault()->mmfar, guard_last_word());
    check_frame();

    guard_on();
    harness_expect_fault(AFTER_OVERFLOW, false);
    (void)recurse(0u);
    harness_true("fault: endless recursion ends in a fault", false);
    harness_end();
}

static void after_overflow(void)
{
    const struct harness_fault *fault = harness_last_fault();
    harness_equal("fault: stack overflow is a MemManage fault", fault->exception, SCB_EXCEPTION_MEMMANAGE);
    harness_true("fault: by an access or by stacking", (fault->cfsr & (SCB_CFSR_DACCVIOL | SCB_CFSR_MSTKERR)) != 0u);

    /* The stack pointer deep in the guard: nothing can be stacked, and there is no frame to read. */
    guard_on();
    harness_expect_fault(AFTER_STACK_IN_GUARD, false);
    __asm volatile("msr msp, %0\n\tpush {r0}" : : "r"(link_stack_guard_start + 16) : "memory");
    __builtin_unreachable();
}

static void after_stack_in_guard(void)
{
    harness_equal("fault: stack pointer in the guard is a MemManage fault", harness_last_fault()->exception,
                  SCB_EXCEPTION_MEMMANAGE);
    harness_true("fault: stacking failed", (harness_last_fault()->cfsr & SCB_CFSR_MSTKERR) != 0u);
    harness_true("fault: there is no frame", !harness_last_fault()->frame_valid);

    scb_enable_faults();
    harness_expect_fault(AFTER_UNHANDLED, false);
    nvic_enable(MSS_IRQ_GPIO(5u));
    nvic_pend(MSS_IRQ_GPIO(5u));
    harness_true("fault: an interrupt without handler is a fault", false);
    harness_end();
}

static void after_unhandled(void)
{
    check_fault("fault: interrupt without handler, by its number", 16u + MSS_IRQ_GPIO(5u), 0u);
    check_frame();

    scb_enable_faults();
    harness_expect_fault(AFTER_UNDEFINED, false);
    __asm volatile("udf #0");
    harness_true("fault: an undefined instruction is a fault", false);
    harness_end();
}

static void after_undefined(void)
{
    check_fault("fault: undefined instruction is a usage fault", SCB_EXCEPTION_USAGEFAULT, SCB_CFSR_UNDEFINSTR);
    check_frame();
    harness_equal("fault: pc is the undefined instruction", code_at(harness_last_fault()->pc), 0xDE00u);

    scb_enable_faults();
    harness_expect_fault(AFTER_BUS_FAULT, false);
    (void)*(volatile uint32_t *)NO_MEMORY;
    harness_true("fault: a read of nothing is a fault", false);
    harness_end();
}

static void after_bus_fault(void)
{
    check_fault("fault: read of nothing is a bus fault", SCB_EXCEPTION_BUSFAULT,
                SCB_CFSR_PRECISERR | SCB_CFSR_BFARVALID);
    harness_equal("fault: BFAR", harness_last_fault()->bfar, NO_MEMORY);
    check_frame();

    scb_enable_faults();
    harness_expect_fault(AFTER_DIVISION, false);
    uint32_t quotient;
    __asm volatile("udiv %0, %1, %2" : "=r"(quotient) : "r"(1u), "r"(0u));
    harness_note("quotient", quotient);
    harness_true("fault: a division by zero is a fault", false);
    harness_end();
}

static void after_division(void)
{
    check_fault("fault: division by zero is a usage fault", SCB_EXCEPTION_USAGEFAULT, SCB_CFSR_DIVBYZERO);
    check_frame();

    scb_enable_faults();
    harness_expect_fault(AFTER_NESTED, true);
    __asm volatile("udf #0");
    harness_true("fault: an undefined instruction is a fault", false);
    harness_end();
}

static void after_nested(void)
{
    const struct harness_fault *fault = harness_last_fault();
    harness_equal("fault: a fault in the fault handler is a hard fault", fault->exception, 3u);
    harness_true("fault: forced", (fault->hfsr & (1u << 30)) != 0u);
    harness_true("fault: its frame is valid", fault->frame_valid);
    harness_between("fault: its frame is on the fault stack", fault->frame_address,
                    (uint32_t)(uintptr_t)link_fault_stack_limit,
                    (uint32_t)(uintptr_t)link_fault_stack_top - (uint32_t)sizeof(struct fault_frame));
    harness_equal("fault: its pc is the second undefined instruction", code_at(fault->pc), 0xDE01u);
}

int main(void)
{
    static void (*const stages[])(void) = {
        [POWER_ON] = power_on,
        [AFTER_SOFT_RESET] = after_soft_reset,
        [AFTER_GUARD_WRITE] = after_guard_write,
        [AFTER_OVERFLOW] = after_overflow,
        [AFTER_STACK_IN_GUARD] = after_stack_in_guard,
        [AFTER_UNHANDLED] = after_unhandled,
        [AFTER_UNDEFINED] = after_undefined,
        [AFTER_BUS_FAULT] = after_bus_fault,
        [AFTER_DIVISION] = after_division,
        [AFTER_NESTED] = after_nested,
    };
    stages[harness_begin()]();
    harness_end();
}

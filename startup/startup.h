/* SPDX-License-Identifier: MIT */
/*
 * What the lowest layer offers to the ones above: the handlers in the vector table, the fault entry, the symbols the
 * linker script defines and the measure of the stack.
 *
 * A handler is installed by defining a function of the name below; the table holds weak defaults for all of them.
 * All names are declared here on purpose: with -Wmissing-prototypes a misspelt handler does not compile, where it
 * would otherwise link and never be called. Names and order: SmartFusion2 MSS user guide (UG0331), interrupt chapter.
 */
#ifndef STARTUP_STARTUP_H
#define STARTUP_STARTUP_H

#include <stddef.h>
#include <stdint.h>

/* ---- the vector table ---------------------------------------------------------------------------------------- */

/* X(exception number, handler) for the exceptions of the core which are not faults. */
#define STARTUP_SYSTEM_HANDLERS(X) \
    X(11, SVC_Handler) \
    X(12, DebugMon_Handler) \
    X(14, PendSV_Handler) \
    X(15, SysTick_Handler)

/* X(exception number, handler) for the faults; NMI is the watchdog's time-out interrupt on this device. */
#define STARTUP_FAULT_HANDLERS(X) \
    X(2, NMI_Handler) \
    X(3, HardFault_Handler) \
    X(4, MemManage_Handler) \
    X(5, BusFault_Handler) \
    X(6, UsageFault_Handler)

/* X(interrupt number, handler) for the 82 external interrupts, in order and without a gap. */
#define STARTUP_EXTERNAL_HANDLERS(X) \
    X(0, WdogWakeup_IRQHandler) \
    X(1, RTC_Wakeup_IRQHandler) \
    X(2, SPI0_IRQHandler) \
    X(3, SPI1_IRQHandler) \
    X(4, I2C0_IRQHandler) \
    X(5, I2C0_SMBAlert_IRQHandler) \
    X(6, I2C0_SMBus_IRQHandler) \
    X(7, I2C1_IRQHandler) \
    X(8, I2C1_SMBAlert_IRQHandler) \
    X(9, I2C1_SMBus_IRQHandler) \
    X(10, UART0_IRQHandler) \
    X(11, UART1_IRQHandler) \
    X(12, EthernetMAC_IRQHandler) \
    X(13, DMA_IRQHandler) \
    X(14, Timer1_IRQHandler) \
    X(15, Timer2_IRQHandler) \
    X(16, CAN_IRQHandler) \
    X(17, ENVM0_IRQHandler) \
    X(18, ENVM1_IRQHandler) \
    X(19, ComBlk_IRQHandler) \
    X(20, USB_IRQHandler) \
    X(21, USB_DMA_IRQHandler) \
    X(22, PLL_Lock_IRQHandler) \
    X(23, PLL_LockLost_IRQHandler) \
    X(24, CommSwitchError_IRQHandler) \
    X(25, CacheError_IRQHandler) \
    X(26, DDR_IRQHandler) \
    X(27, HPDMA_Complete_IRQHandler) \
    X(28, HPDMA_Error_IRQHandler) \
    X(29, ECC_Error_IRQHandler) \
    X(30, MDDR_IOCalib_IRQHandler) \
    X(31, FAB_PLL_Lock_IRQHandler) \
    X(32, FAB_PLL_LockLost_IRQHandler) \
    X(33, FIC64_IRQHandler) \
    X(34, FabricIrq0_IRQHandler) \
    X(35, FabricIrq1_IRQHandler) \
    X(36, FabricIrq2_IRQHandler) \
    X(37, FabricIrq3_IRQHandler) \
    X(38, FabricIrq4_IRQHandler) \
    X(39, FabricIrq5_IRQHandler) \
    X(40, FabricIrq6_IRQHandler) \
    X(41, FabricIrq7_IRQHandler) \
    X(42, FabricIrq8_IRQHandler) \
    X(43, FabricIrq9_IRQHandler) \
    X(44, FabricIrq10_IRQHandler) \
    X(45, FabricIrq11_IRQHandler) \
    X(46, FabricIrq12_IRQHandler) \
    X(47, FabricIrq13_IRQHandler) \
    X(48, FabricIrq14_IRQHandler) \
    X(49, FabricIrq15_IRQHandler) \
    X(50, GPIO0_IRQHandler) \
    X(51, GPIO1_IRQHandler) \
    X(52, GPIO2_IRQHandler) \
    X(53, GPIO3_IRQHandler) \
    X(54, GPIO4_IRQHandler) \
    X(55, GPIO5_IRQHandler) \
    X(56, GPIO6_IRQHandler) \
    X(57, GPIO7_IRQHandler) \
    X(58, GPIO8_IRQHandler) \
    X(59, GPIO9_IRQHandler) \
    X(60, GPIO10_IRQHandler) \
    X(61, GPIO11_IRQHandler) \
    X(62, GPIO12_IRQHandler) \
    X(63, GPIO13_IRQHandler) \
    X(64, GPIO14_IRQHandler) \
    X(65, GPIO15_IRQHandler) \
    X(66, GPIO16_IRQHandler) \
    X(67, GPIO17_IRQHandler) \
    X(68, GPIO18_IRQHandler) \
    X(69, GPIO19_IRQHandler) \
    X(70, GPIO20_IRQHandler) \
    X(71, GPIO21_IRQHandler) \
    X(72, GPIO22_IRQHandler) \
    X(73, GPIO23_IRQHandler) \
    X(74, GPIO24_IRQHandler) \
    X(75, GPIO25_IRQHandler) \
    X(76, GPIO26_IRQHandler) \
    X(77, GPIO27_IRQHandler) \
    X(78, GPIO28_IRQHandler) \
    X(79, GPIO29_IRQHandler) \
    X(80, GPIO30_IRQHandler) \
    X(81, GPIO31_IRQHandler)

/*
 * The table the core uses: a copy of the one in flash, made at reset, so that a handler can be replaced by a store. Index:
 * exception number, the first is the initial stack. Follow the store by a DSB (ARMv7-M, B1.5.3). Whoever stores sees to it
 * that the interrupt's two handlers may change places at that time.
 */
extern void (*startup_vectors[])(void);

#define STARTUP_SYSTEM_VECTORS   16u
#define STARTUP_EXTERNAL_VECTORS 82u

#define STARTUP_DECLARE_HANDLER(number, handler) void handler(void);
STARTUP_FAULT_HANDLERS(STARTUP_DECLARE_HANDLER)
STARTUP_SYSTEM_HANDLERS(STARTUP_DECLARE_HANDLER)
STARTUP_EXTERNAL_HANDLERS(STARTUP_DECLARE_HANDLER)
#undef STARTUP_DECLARE_HANDLER

/* Where the core starts. Never returns; calls main(). */
void Reset_Handler(void) __attribute__((noreturn));

/* ---- faults -------------------------------------------------------------------------------------------------- */

/* What the core pushes on exception entry (ARMv7-M architecture reference manual, B1.5.6). */
struct fault_frame {
    uint32_t r0, r1, r2, r3, r12, lr, pc, xpsr;
};

/*
 * Called for NMI, every fault and every exception or interrupt nobody handles, from an entry which needs no stack.
 *
 * frame       what the core stacked, or NULL if the stack pointer does not point into usable RAM (an overflow into the
 *             guard: the core could not write the frame, so there is nothing to read).
 * exc_return  the link register at entry: bit 3 thread mode, bit 2 process stack (ARMv7-M, B1.5.8).
 *
 * Context: the faulting exception's own priority, interrupts masked by PRIMASK, on the dedicated fault stack of
 * LINK_FAULT_STACK_SIZE. A fault inside it comes in again as HardFault, below the first one on the same stack; one
 * inside that locks the core up, which this device answers with a reset. If it returns, the core stops in an endless
 * loop and the watchdog ends that.
 *
 * Weak: the default does nothing. An image that drives a bridge defines it and switches the bridge off first.
 */
void fault_taken(const struct fault_frame *frame, uint32_t exc_return);

/* Number of the exception being served: 0 thread mode, 2 NMI ... 6 usage fault, 16 + n external interrupt n. */
static inline uint32_t startup_exception_number(void)
{
    uint32_t ipsr;
    __asm volatile("mrs %0, ipsr" : "=r"(ipsr));
    return ipsr & 0x1FFu;
}

/* ---- symbols of linker/m2s010.ld: only their addresses mean something ----------------------------------------- */

extern uint32_t link_ram_start[];         /* first byte of eSRAM in use */
extern uint32_t link_ram_end[];           /* one past its last */
extern uint32_t link_data_start[];        /* behind the stacks: variables */
extern uint32_t link_stack_guard_start[]; /* the guard below the main stack, aligned to its power-of-two size */
extern uint32_t link_stack_limit[];       /* end of the guard = lowest word the main stack may use */
extern uint32_t link_stack_top[];         /* initial main stack pointer */
extern uint32_t link_fault_stack_limit[]; /* the stack of the fault entry */
extern uint32_t link_fault_stack_top[];
extern uint32_t link_noinit_start[]; /* kept over every reset but power-on */
extern uint32_t link_noinit_end[];

/* The image's first word: where the core sees it, and in the array. drivers/mss/cache.h locks what begins there. */
extern const uint32_t link_code[];
extern const uint32_t link_array[];

/* Where settings are kept in eNVM, by the array's own address: two slots of equal size, the second from slot_1 on. */
extern const uint32_t link_settings_start[];
extern const uint32_t link_settings_slot_1[];
extern const uint32_t link_settings_end[];

/* Puts a variable where it survives every reset but power-on (zero after that). It may have no initialiser. */
#define STARTUP_NOINIT __attribute__((section(".noinit")))

/* ---- stack ---------------------------------------------------------------------------------------------------- */

/* What reset fills the main stack with. */
#define STARTUP_STACK_PAINT 0xC5A3C5A3u

/*
 * Bytes of the main stack which were never written since reset (a multiple of 4; the high-water mark).
 * Context: any. Runs over the unused stack, about 4 cycles a word: not for interrupts.
 */
size_t startup_stack_unused_bytes(void);

#endif

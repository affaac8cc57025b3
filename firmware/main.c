/* SPDX-License-Identifier: MIT */
/* Start-up of the drive, and the thread: the console and the bus. Everything that moves the motor runs in interrupts. */
#include <stddef.h>

#include "drivers/cortex/nvic.h"
#include "drivers/mss/mmuart.h"
#include "firmware/operate/canopen.h"
#include "firmware/operate/console.h"
#include "firmware/operate/modbus.h"
#include "firmware/settings/config.h"
#include "firmware/settings/features.h"
#include "firmware/system/boot.h"
#include "firmware/system/handlers.h"
#include "firmware/system/idle.h"
#include "startup/startup.h"

int main(void);

static struct mmuart uart;     /* shared with its interrupt */
static struct rs485 bus;       /* likewise */
static struct modbus modbus;   /* too large for the stack */
static struct can can;         /* shared with its interrupt */
static struct canopen canopen; /* too large for the stack */

void UART0_IRQHandler(void)
{
    if (FEATURE_IN(CONSOLE)) {
        mmuart_irq_handler(&uart);
    }
}

void UART1_IRQHandler(void)
{
    if (FEATURE_IN(MODBUS)) {
        rs485_uart_handler(&bus);
    }
}

void Timer2_IRQHandler(void)
{
    if (FEATURE_IN(MODBUS)) {
        rs485_timer_handler(&bus);
    }
}

void CAN_IRQHandler(void)
{
    if (FEATURE_IN(CAN)) {
        can_irq_handler(&can);
    }
}

static void start_can(const struct slots *slots)
{
    nvic_priority(BOARD_IRQ_CAN, CONFIG_PRIORITY_CAN);
    nvic_enable(BOARD_IRQ_CAN);
    canopen_start(&canopen, &can, axes, slots);
}

static void start_bus(const struct slots *slots)
{
    modbus_start(&modbus, &bus, axes, slots);
    nvic_priority(BOARD_IRQ_BUS, CONFIG_PRIORITY_BUS);
    nvic_priority(BOARD_IRQ_RELEASE, CONFIG_PRIORITY_BUS);
    nvic_enable(BOARD_IRQ_BUS);
    nvic_enable(BOARD_IRQ_RELEASE);
}

static void start_uart(void)
{
    nvic_priority(BOARD_IRQ_CONSOLE, CONFIG_PRIORITY_CONSOLE);
    nvic_enable(BOARD_IRQ_CONSOLE);
    (void)mmuart_init(&uart, MMUART0, CONFIG_CONSOLE_BAUD); /* a constant rate, checked by the compiler */
    mmuart_use_flow_control(&uart);
}

static void start_axes(enum fault boot_fault)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        const bool led =
            n == 0u || !axis_fabric_is_untrusted(
                           &axes[0]); /* else the second axis' carrier, synchronized to the first, would never start */
        drive_start(&axes[n], led ? boot_fault : FAULT_FABRIC);
        if (!axis_fabric_is_untrusted(&axes[n])) {
            handlers_start_current_loop(n);
        }
    }
    if (FEATURE_IN(SCOPE)) {
        handlers_start_scope();
    }
    handlers_start_slow_loop();
    if (boot_fault != FAULT_CLOCK) {
        handlers_watch_device(); /* else an unlocked PLL would end each run of the program */
    }
}

/* By the array's own address: the cache of the code at 0 is not updated by programming. Axis 2's are below axis 1's. */
static struct slots settings_slots(uint32_t axis)
{
    const uint32_t slot_bytes = (uint32_t)((uintptr_t)link_settings_slot_1 - (uintptr_t)link_settings_start);
    const uint32_t below_bytes = axis * SLOTS * slot_bytes;
    return (struct slots){
        .memory = (const uint8_t *)link_settings_start - below_bytes,
        .offset_bytes = (uint32_t)(uintptr_t)link_settings_start - below_bytes - ENVM_ARRAY,
        .slot_bytes = slot_bytes,
    };
}

/* After the PWM's start, which need not wait for these. */
static void start_behind_pwm(const struct slots *slots, struct nvm_report *loaded)
{
    if (FEATURE_IN(MODBUS)) {
        start_bus(slots);
    }
    for (uint32_t n = 0; n < AXIS_COUNT && FEATURE_IN(SETTINGS); n++) {
        drive_load_at_boot(&axes[n], &slots[n], &loaded[n]);
    }
    if (FEATURE_IN(CAN)) {
        start_can(slots);
    }
}

static void serve_axis(struct axis *axis)
{
    drive_retry(axis);
    if (FEATURE_IN(LEARN)) {
        drive_learn(axis);
    }
    if (FEATURE_IN(SETTINGS)) {
        drive_restore_cogging(axis);
    }
    if (FEATURE_IN(IDENTIFY)) {
        identify_evaluate(&axis->identify);
    }
}

/* One pass over all services; true if the console has more to do. */
static bool serve(struct console *console, struct idle *rest)
{
    const bool more = FEATURE_IN(CONSOLE) && console_poll(console);
    if (FEATURE_IN(MODBUS)) {
        modbus_poll(&modbus);
    }
    if (FEATURE_IN(CAN)) {
        canopen_poll(&canopen);
    }
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        idle_serve_watchdog(rest);
        serve_axis(&axes[n]);
    }
    return more;
}

/* What wakes the thread, and where it reports progress. */
static struct idle idle_lines(void)
{
    const volatile uint32_t *const none = &axes[0].time_ms;
    return (struct idle){.time_ms = &axes[0].time_ms,
                         .progress_ms = {&axes[0].thread_ms, &axes[AXIS_COUNT - 1u].thread_ms},
                         .received = {FEATURE_IN(CONSOLE) ? &uart.rx_head : none,
                                      FEATURE_IN(MODBUS) ? &bus.uart.rx_head : none,
                                      FEATURE_IN(CAN) ? &can.rx_head : none}};
}

/* First of all: marks the fabric as untrusted, for a processor fault. */
static void init_axes(struct slots *slots)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        slots[n] = settings_slots(n);
        drive_init(&axes[n], FABRIC(n));
        drive_restore_temperatures(&axes[n], &axes_heat[n]);
    }
    if (AXIS_COUNT == 2u) {
        drive_link(&axes[0], &axes[AXIS_COUNT - 1u]);
    }
}

/* One part of the work of switching on, for each axis; true if there is more. */
static bool prepare_axes(void)
{
    bool more = false;
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        more = drive_prepare(&axes[n]) || more;
    }
    return more;
}

int main(void)
{
    struct postmortem last_run;
    struct console console;
    struct idle rest = idle_lines();
    struct slots slots[AXIS_COUNT];
    struct nvm_report loaded[AXIS_COUNT] = {{.state = NVM_NOTHING}};
    init_axes(slots);
    boot_core();
    const enum fault boot_fault = boot_check(FABRIC0, &last_run);
    if (FEATURE_IN(CONSOLE)) {
        start_uart();
    }
    start_axes(boot_fault);
    start_behind_pwm(slots, loaded);
    if (FEATURE_IN(CONSOLE)) {
        console_start(&console, &(struct session){
                                    .out = {.uart = &uart,
                                            .idle = &rest,
                                            .bus = FEATURE_IN(MODBUS) ? &modbus : NULL,
                                            .can = FEATURE_IN(CAN) ? &canopen : NULL},
                                    .axes = axes,
                                    .axis = &axes[0],
                                    .scope = FEATURE_IN(SCOPE) ? &scope : NULL,
                                    .last_run = &last_run,
                                    .slots = slots,
                                    .loaded = loaded,
                                });
    }
    for (;;) {
        const bool more = serve(&console, &rest);
        if (prepare_axes() || more) {
            idle_serve_watchdog(&rest);
        } else {
            idle(&rest);
        }
    }
}

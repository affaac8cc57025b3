/* SPDX-License-Identifier: MIT */
#include <stddef.h>

#include "firmware/operate/commands.h"
#include "firmware/settings/config.h"
#include "firmware/system/handlers.h"
#include "startup/startup.h"
#include "tests/bench/print.h"
#include "tests/bench/rows.h"
#include "tests/bench/vectors.h"

#define CONSOLE_ROUNDS 31u

static char line[16];
static struct tuning tuning;
static struct torque_builder builder;
static bool part_follows;
static struct idle rest = {.time_ms = &axes[0].time_ms};
static struct postmortem no_record;
static struct session session = {.out = {.uart = &print_uart, .idle = &rest}, .axis = &axes[0], .last_run = &no_record};

TIMING_FUNCTION(time_fault, fault_raise(&axes[0], FAULT_OVERCURRENT))
TIMING_FUNCTION(time_command, commands_execute(&session, line))
TIMING_FUNCTION(time_tuning, (void)tuning_compute(&axes[0].params, &tuning))
TIMING_FUNCTION(time_tables, rows_build_tables())
TIMING_FUNCTION(time_part,
                part_follows = torque_build_step(&builder, &axes[0].torque, &axes[0].params, &axes[0].tuning))
TIMING_FUNCTION(time_uart, UART0_IRQHandler())

static void row_fault(const char *name, bool first)
{
    timing_begin(&rows_timing);
    for (uint32_t i = 0; i < TIMING_TYPICAL; i++) {
        axes[0].faults.cause = first ? FAULT_NONE : FAULT_STALL;
        timing_add_typical(&rows_timing, timing_once(time_fault, NULL, NULL));
    }
    axes[0].faults.cause = FAULT_NONE;
    rows_print(name);
}

/* A command splits its line in place, so it gets a new one each time. */
static void type(const char *text)
{
    uint32_t k = 0;
    for (; text[k] != '\0' && k < sizeof line - 1u; k++) {
        line[k] = text[k];
    }
    line[k] = '\0';
}

/* The answer goes into the transmit buffer, which has room for it, and is thrown away there. */
static void row_command(const char *name, const char *text)
{
    print_flush();
    vector_restart();
    timing_begin(&rows_timing);
    for (uint32_t i = 0; i < CONSOLE_ROUNDS; i++) {
        axes[0].loop.i_d_q15 = vector_random(-32768, 32767);
        axes[0].loop.i_q_q15 = vector_random(-32768, 32767);
        axes[0].loop.i_d_ref_q15 = vector_random(-32768, 32767);
        axes[0].loop.i_q_ref_q15 = vector_random(-32768, 32767);
        axes[0].loop.vbus_q15 = vector_random(8192, 32760);
        axes[0].speed.speed_rpm_q4 = vector_random(-320000, 320000);
        axes[0].speed.speed_ref_rpm_q4 = vector_random(-320000, 320000);
        type(text);
        const uint32_t mask = cpu_irq_save();
        timing_add_typical(&rows_timing, timing_once(time_command, NULL, NULL));
        (void)mmuart_init(&print_uart, MMUART0, CONFIG_CONSOLE_BAUD);
        cpu_irq_restore(mask);
    }
    rows_print(name);
}

/* The longest one: the transmitter takes sixteen characters. They are a remark in the table. */
static void row_uart(void)
{
    print_flush();
    const uint32_t mask = cpu_irq_save();
    print_text("# uart: sixteen at once\r\n");
    const uint32_t cycles = timing_once(time_uart, NULL, NULL);
    cpu_irq_restore(mask);
    const struct timing_figures figures = {cycles, cycles, cycles};
    print_row("console.interrupt", &figures, NULL);
}

static void row_tuning(void)
{
    timing_begin(&rows_timing);
    timing_add_typical(&rows_timing, timing_once(time_tuning, NULL, NULL));
    rows_print("tuning_compute");
}

/* Between two of which the thread serves its lines. */
static void row_parts(void)
{
    timing_begin(&rows_timing);
    torque_build_begin(&builder, &axes[0].torque, &axes[0].params, &axes[0].tuning, 16384);
    do {
        timing_add_typical(&rows_timing, timing_once(time_part, NULL, NULL));
    } while (part_follows);
    rows_print("torque_build.part");
}

/* With saliency, which the initial motor does not have. */
static void row_tables(void)
{
    axes[0].params.lq_uh *= 2;
    timing_begin(&rows_timing);
    timing_add_typical(&rows_timing, timing_once(time_tables, NULL, NULL));
    rows_print("torque_build");
    row_parts();
    axes[0].params.lq_uh /= 2;
    rows_build_tables();
}

void rows_seldom(void)
{
    print_heading("faults: the first, which takes the snapshot, and any later one; the console; tuning");
    row_fault("fault_raise.first", true);
    row_fault("fault_raise.again", false);
    row_command("console.status", "status");
    row_command("console.unknown", "no such");
    row_uart();
    row_tuning();
    row_tables();
}

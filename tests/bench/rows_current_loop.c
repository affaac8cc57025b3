/* SPDX-License-Identifier: MIT */
#include <stddef.h>

#include "drivers/board.h"
#include "drivers/cortex/nvic.h"
#include "drivers/fabric/fabric.h"
#include "drivers/mss/watchdog.h"
#include "firmware/settings/config.h"
#include "firmware/system/handlers.h"
#include "startup/startup.h"
#include "tests/bench/loop_state.h"
#include "tests/bench/print.h"
#include "tests/bench/rows.h"
#include "tests/bench/vectors.h"

#define SPINS 100000u /* some 40 periods of the PWM */
#define POLLS 1000000u

TIMING_LOCKED TIMING_FUNCTION(time_handler, FabricIrq0_IRQHandler())

    static uint32_t handler_called(void)
{
    return timing_once(time_handler, NULL, NULL);
}

static uint32_t handler_interrupting(void)
{
    return rows_time_interrupt(BOARD_IRQ_ADC);
}

/* Over all states of the loop. */
static struct timing_figures over_states(uint32_t (*measure)(void))
{
    vector_restart();
    timing_begin(&rows_timing);
    for (uint32_t i = 0; i < TIMING_TYPICAL; i++) {
        loop_state_typical(&axes[0].loop);
        timing_add_typical(&rows_timing, measure());
    }
    for (uint32_t i = 0; i < LOOP_STATE_EXTREMES; i++) {
        loop_state_extreme(&axes[0].loop, i);
        timing_add_extreme(&rows_timing, measure());
    }
    return timing_figures(&rows_timing);
}

static void print_handler(const char *name, uint32_t (*measure)(void))
{
    const struct timing_figures figures = over_states(measure);
    print_row(name, &figures, NULL);
}

/* The interrupt with this handler in its vector. */
static void row_handler(const char *name, void (*handler)(void))
{
    void (*const before)(void) = *handlers_of_axes[0].vector;
    *handlers_of_axes[0].vector = handler;
    cpu_dsb();
    print_handler(name, handler_interrupting);
    *handlers_of_axes[0].vector = before;
    cpu_dsb();
}

/* Whatever the switches of the plant show: half of the times an edge comes with the sample. */
static uint32_t handler_with_edge(void)
{
    struct hall *const h = &axes[0].hall;
    h->state = encoder_hall_latched(&FABRIC0->encoder) ^ (h->count & 1u);
    h->count ^= 1u;
    return handler_interrupting();
}

static void row_hall(const char *name, void (*handler)(void))
{
    struct hall_table table;
    void (*const before)(void) = *handlers_of_axes[0].vector;
    (void)hall_table_of(&axes[0].params, &table);
    hall_take_table(&axes[0].hall, &table, &axes[0].tuning);
    *handlers_of_axes[0].vector = handler;
    cpu_dsb();
    print_handler(name, handler_with_edge);
    *handlers_of_axes[0].vector = before;
    cpu_dsb();
}

static void rows_handlers(void)
{
    row_handler("handler.assembly", FabricIrq0_IRQHandler);
    row_handler("handler.encoder_ab", handlers_encoder_ab);
    row_handler("handler.forced_ab", handlers_forced_ab);
    row_handler("handler.observer_ab", handlers_observer_ab);
    row_handler("handler.injection_ab", handlers_injection_ab);
    row_hall("handler.hall_ab", handlers_hall_ab);
    row_handler("handler.weakening_ab", handlers_weakening_ab);
    row_handler("handler.overmodulating_ab", handlers_overmodulating_ab);
}

/* Turns on the spot: the same instructions every time, so that what it takes longer was taken by interrupts. */
static __attribute__((noinline, aligned(8))) uint32_t spin(uint32_t turns)
{
    const uint32_t start = dwt_cycles();
    do {
        __asm volatile("" : "+r"(turns));
    } while (--turns != 0u);
    return dwt_cycles() - start;
}

/* With the ADC interrupting: what an interrupt takes from the program below it, on average, rounded to nearest. */
static void row_stolen(void)
{
    watchdog_refresh();
    const uint32_t mask = cpu_irq_save();
    const uint32_t alone = spin(SPINS);
    cpu_irq_restore(mask);
    loop_state_typical(&axes[0].loop);
    print_flush(); /* or the console would take its share */
    adc_start(&FABRIC0->adc);
    const uint32_t first = adc_sequence(&FABRIC0->adc);
    for (uint32_t poll = 0; poll < POLLS && adc_sequence(&FABRIC0->adc) == first; poll++) {
        watchdog_refresh();
    }
    const uint32_t before = adc_sequence(&FABRIC0->adc);
    const uint32_t together = spin(SPINS);
    const uint32_t interrupts = adc_sequence(&FABRIC0->adc) - before;
    adc_stop(&FABRIC0->adc);
    print_note("interrupts by the ADC", interrupts);
    if (interrupts == 0u) {
        print_heading("no interrupts came: is the fabric's design loaded?");
        return;
    }
    const uint32_t each = (together - alone + interrupts / 2u) / interrupts;
    const struct timing_figures figures = {each, each, each};
    print_row("current_loop.stolen", &figures, NULL);
}

/* One conversion, its interrupt not taken: the flags of the limits stay as it leaves them. */
static void convert_once(void)
{
    nvic_disable(BOARD_IRQ_ADC);
    adc_start(&FABRIC0->adc);
    const uint32_t first = adc_sequence(&FABRIC0->adc);
    for (uint32_t poll = 0; poll < POLLS && adc_sequence(&FABRIC0->adc) == first; poll++) {
        watchdog_refresh();
    }
    adc_stop(&FABRIC0->adc);
    nvic_enable(BOARD_IRQ_ADC);
}

/* A bus voltage below its limit in the sample: the longest way through the interrupt. */
static void row_trip(void)
{
    adc_set_limits(&FABRIC0->adc, INT16_MAX, INT16_MAX, INT16_MAX, INT16_MAX);
    convert_once();
    vector_restart();
    timing_begin(&rows_timing);
    for (uint32_t i = 0; i < TIMING_TYPICAL; i++) {
        loop_state_typical(&axes[0].loop);
        axes[0].loop.status_max = GATE_STATUS_LIVE;
        axes[0].faults.cause = FAULT_NONE;
        timing_add_typical(&rows_timing, timing_once(time_handler, NULL, NULL));
    }
    axes[0].loop.status_max = UINT32_MAX;
    axes[0].faults.cause = FAULT_NONE;
    adc_set_limits(&FABRIC0->adc, INT16_MAX, INT16_MAX, 0, INT16_MAX);
    convert_once();
    rows_print("current_loop.trip");
}

void rows_current_loop(void)
{
    loop_state_init(&axes[0].loop);
    print_heading("current loop: called; as an interrupt, entry and exit included; what the ADC's interrupts take");
    print_handler("current_loop.called", handler_called);
    print_handler("current_loop.pended", handler_interrupting);
    rows_handlers();
    row_stolen();
    row_trip();
}

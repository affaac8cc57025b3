/* SPDX-License-Identifier: MIT */
#include "tests/bench/print.h"

#include <stddef.h>

#include "drivers/cortex/nvic.h"
#include "drivers/mss/watchdog.h"
#include "firmware/settings/config.h"
#include "startup/startup.h"

#define NAME_WIDTH   26u
#define NUMBER_WIDTH 9u

static uint32_t rows;

struct mmuart print_uart;

void UART0_IRQHandler(void)
{
    mmuart_irq_handler(&print_uart);
}

void print_start(uint32_t baud)
{
    nvic_priority(BOARD_IRQ_CONSOLE, CONFIG_PRIORITY_CONSOLE);
    nvic_enable(BOARD_IRQ_CONSOLE);
    (void)mmuart_init(&print_uart, MMUART0, baud);
}

static void put(char character)
{
    while (!mmuart_put(&print_uart, character)) {
        watchdog_refresh();
    }
}

void print_text(const char *text)
{
    for (; *text != '\0'; text++) {
        put(*text);
    }
}

static void put_blanks(uint32_t used, uint32_t width)
{
    for (; used < width; used++) {
        put(' ');
    }
}

static void put_number(uint32_t value, uint32_t width)
{
    char digits[10];
    uint32_t count = 0;
    do {
        digits[count++] = (char)('0' + value % 10u);
        value /= 10u;
    } while (value != 0u);
    put_blanks(count, width);
    while (count > 0u) {
        put(digits[--count]);
    }
}

void print_number(uint32_t value)
{
    put_number(value, 0u);
}

void print_note(const char *name, uint32_t value)
{
    print_text("# ");
    print_text(name);
    put(' ');
    print_number(value);
    print_text("\r\n");
}

void print_heading(const char *text)
{
    print_text("#\r\n# ");
    print_text(text);
    print_text("\r\n");
}

static void put_figures(const struct timing_figures *figures)
{
    put_number(figures->min, NUMBER_WIDTH);
    put_number(figures->median, NUMBER_WIDTH);
    put_number(figures->max, NUMBER_WIDTH);
}

void print_row(const char *name, const struct timing_figures *figures, const struct print_comparison *comparison)
{
    uint32_t length = 0;
    for (; name[length] != '\0'; length++) {
        put(name[length]);
    }
    put_blanks(length, NAME_WIDTH);
    put_figures(figures);
    if (comparison != NULL) {
        print_text("  moves");
        put_number(comparison->moves, NUMBER_WIDTH - 3u);
        print_text("  O2");
        put_figures(&comparison->o2);
        print_text("  O3");
        put_figures(&comparison->o3);
    }
    print_text("\r\n");
    rows++;
}

void print_flush(void)
{
    while (!mmuart_is_idle(&print_uart)) {
        watchdog_refresh();
    }
}

void print_closing(void)
{
    print_text("bench: ");
    print_number(rows);
    print_text(" rows\r\n");
    print_flush();
}

/* SPDX-License-Identifier: MIT */
/* Lines on the console, by polling: interrupts are what is looked at here. */
#include "drivers/bringup/bringup.h"

#define TEXT_COLUMNS  40u
#define VALUE_COLUMNS 14u
#define LINE_BYTES    128u

enum format { HEX, DECIMAL };

struct row {
    const char *step;
    enum format format;
    uint32_t least, largest;
    const char *text;
};

/* clang-format off: it takes the list for code */
#define ROW(name, ...)            [FACT_##name] = {ROW_OF(__VA_ARGS__)},
#define ROW_OF(step, format, ...) step, format, __VA_ARGS__
static const struct row rows[FACTS] = {BRINGUP_FACTS(ROW)};
/* clang-format on */

struct line {
    uint32_t length;
    char text[LINE_BYTES];
};

static void add_character(struct line *line, char character)
{
    if (line->length < LINE_BYTES - 1u) {
        line->text[line->length++] = character;
    }
}

static void add(struct line *line, const char *text)
{
    while (*text != '\0') {
        add_character(line, *text++);
    }
}

static void fill(struct line *line, uint32_t column)
{
    do {
        add_character(line, ' ');
    } while (line->length < column);
}

static void add_number(struct line *line, enum format format, uint32_t value)
{
    const uint32_t base = format == HEX ? 16u : 10u;
    char digits[10];
    uint32_t count = 0;
    do {
        digits[count++] = "0123456789ABCDEF"[value % base];
        value /= base;
    } while (value != 0u);
    add(line, format == HEX ? "0x" : "");
    while (count > 0u) {
        add_character(line, digits[--count]);
    }
}

static void end(struct line *line)
{
    add(line, "\r\n");
    line->text[line->length < LINE_BYTES ? line->length : LINE_BYTES - 1u] = '\0';
    (void)mmuart_emergency_write(MMUART0, line->text);
}

static void say(const char *text)
{
    struct line line = {0};
    add(&line, text);
    end(&line);
}

static void add_documented(struct line *line, const struct row *row)
{
    if (row->least == 0u && row->largest == UINT32_MAX) {
        add(line, "nothing documented");
        return;
    }
    add(line, "documented ");
    add_number(line, row->format, row->least);
    if (row->largest != row->least) {
        add(line, "...");
        add_number(line, row->format, row->largest);
    }
}

void report(struct bringup *b, enum fact fact, uint32_t value)
{
    const struct row *row = &rows[fact];
    struct line line = {0};
    add(&line, row->step);
    fill(&line, 4u);
    add(&line, row->text);
    fill(&line, 4u + TEXT_COLUMNS);
    add_number(&line, row->format, value);
    fill(&line, 4u + TEXT_COLUMNS + VALUE_COLUMNS);
    add_documented(&line, row);
    if (value < row->least || value > row->largest) {
        b->differs[fact / 32u] |= 1u << (fact % 32u);
        add(&line, "   DIFFERS");
    }
    end(&line);
}

void report_text(const char *step, const char *text)
{
    struct line line = {0};
    add(&line, step);
    fill(&line, 4u);
    add(&line, text);
    end(&line);
}

void report_not_ended(struct bringup *b, const char *step, uint32_t causes)
{
    struct line line = {0};
    add(&line, step);
    add(&line, " ended in a reset: RESET_SOURCE_CR ");
    add_number(&line, HEX, causes);
    add(&line, ", exception ");
    add_number(&line, DECIMAL, b->exception);
    add(&line, "   DIFFERS");
    end(&line);
    b->not_ended |= 1u << b->next;
}

void report_title(void)
{
    say("");
    say("mssfoc bring-up: this device, and docs/silicon.md");
}

static bool differs(const struct bringup *b, uint32_t fact)
{
    return ((b->differs[fact / 32u] >> (fact % 32u)) & 1u) != 0u;
}

void report_verdict(const struct bringup *b)
{
    uint32_t count = 0;
    say("Send us this page, whole: it is what we know of your device (docs/silicon.md).");
    for (uint32_t fact = 0; fact < FACTS; fact++) {
        count += differs(b, fact) ? 1u : 0u;
    }
    for (uint32_t steps = b->not_ended; steps != 0u; steps &= steps - 1u) {
        count++;
    }
    if (count == 0u) {
        say("as documented");
        return;
    }
    for (uint32_t fact = 0; fact < FACTS; fact++) {
        if (differs(b, fact)) {
            struct line line = {0};
            add(&line, "differs: ");
            add(&line, rows[fact].step);
            add(&line, " ");
            add(&line, rows[fact].text);
            end(&line);
        }
    }
    struct line line = {0};
    add(&line, "not as documented: ");
    add_number(&line, DECIMAL, count);
    end(&line);
}

/* SPDX-License-Identifier: GPL-2.0-or-later */
#define _GNU_SOURCE
#include "events.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Arguments: t rest of the line, n number, y second number, z third number, s number from 0, i integer, b 0|1, p phase,
 * O order of the phases, q pair of terminals, Q pair of terminals or off, r resistance or off, c ADC code or off,
 * f fraction 0.001...1, S one of two inputs, T temperature or off, x the word off, a address, w 32-bit word, h 16-bit word. */
static const struct syntax {
    const char *name;
    enum event_kind kind;
    const char *arguments;
    const char *usage;
} kinds[] = {
    {"console", EVENT_CONSOLE, "t", "console TEXT"},
    {"keys", EVENT_KEYS, "t", "keys HEXADECIMAL (bytes that are typed at the console)"},
    {"bus", EVENT_BUS, "t", "bus HEXADECIMAL (bytes that somebody sends on the line of MMUART_1)"},
    {"can", EVENT_CAN, "t", "can ID#HEXADECIMAL (a frame that somebody sends on the CAN bus)"},
    {"can_break", EVENT_CAN_BREAK, "w", "can_break FRAMES (of the drive, destroyed on their way)"},
    {"can_cut", EVENT_CAN_CUT, "b", "can_cut 0|1"},
    {"load_nm", EVENT_LOAD, "n", "load_nm TORQUE"},
    {"load_fan", EVENT_LOAD_FAN, "s", "load_fan NM_PER_SQUARE_OF_RAD_S"},
    {"load_coulomb", EVENT_LOAD_COULOMB, "s", "load_coulomb TORQUE"},
    {"load_hoist", EVENT_LOAD_HOIST, "n", "load_hoist TORQUE"},
    {"lock", EVENT_LOCK, "b", "lock 0|1"},
    {"spin_rad_s", EVENT_SPIN, "n", "spin_rad_s SPEED"},
    {"spin", EVENT_SPIN_OFF, "x", "spin off"},
    {"supply_v", EVENT_SUPPLY_V, "s", "supply_v VOLTS"},
    {"supply_sinks", EVENT_SUPPLY_SINKS, "b", "supply_sinks 0|1"},
    {"sensor_add", EVENT_SENSOR_ADD, "pn", "sensor_add A|B|C AMPERES"},
    {"sensor_gain", EVENT_SENSOR_GAIN, "pn", "sensor_gain A|B|C GAIN"},
    {"sensor_offset", EVENT_SENSOR_OFFSET, "pn", "sensor_offset A|B|C LSB"},
    {"sensor_stuck", EVENT_SENSOR_STUCK, "pc", "sensor_stuck A|B|C CODE|off (0...4095)"},
    {"sensor_order", EVENT_SENSOR_ORDER, "O",
     "sensor_order ABC|ACB|BAC|BCA|CAB|CBA (whose currents the channels A, B, C show)"},
    {"sensor_sine", EVENT_SENSOR_SINE, "nyz", "sensor_sine AMPERES HZ ANGLE_RAD (electrical, from the d axis)"},
    {"driver_fault", EVENT_DRIVER_FAULT, "b", "driver_fault 0|1"},
    {"sto", EVENT_STO, "Sb", "sto A|B 0|1 (1: the input asks to stop)"},
    {"short", EVENT_SHORT, "qr", "short AB|BC|CA OHM|off (0.0001...100)"},
    {"winding_short", EVENT_WINDING_SHORT, "pfr", "winding_short A|B|C FRACTION OHM|off (0.001...1, 0.0001...100)"},
    {"encoder_cut", EVENT_ENCODER_CUT, "b", "encoder_cut 0|1"},
    {"encoder_freeze", EVENT_ENCODER_FREEZE, "b", "encoder_freeze 0|1"},
    {"encoder_illegal", EVENT_ENCODER_ILLEGAL, "", "encoder_illegal"},
    {"encoder_slip", EVENT_ENCODER_SLIP, "i", "encoder_slip COUNTS"},
    {"encoder_reverse", EVENT_ENCODER_REVERSE, "b", "encoder_reverse 0|1"},
    {"hall_open", EVENT_HALL_OPEN, "pb", "hall_open A|B|C 0|1"},
    {"hall_invert", EVENT_HALL_INVERT, "pb", "hall_invert A|B|C 0|1"},
    {"hall_swap", EVENT_HALL_SWAP, "Q", "hall_swap AB|BC|CA|off"},
    {"temperature_c", EVENT_TEMPERATURE, "T", "temperature_c DEGREES|off (-100...300)"},
    {"irq_delay", EVENT_IRQ_DELAY, "s", "irq_delay SECONDS"},
    {"irq_block", EVENT_IRQ_BLOCK, "b", "irq_block 0|1"},
    {"watchdog_reset", EVENT_WATCHDOG_RESET, "", "watchdog_reset"},
    {"power_cut", EVENT_POWER_CUT, "", "power_cut"},
    {"phase_open", EVENT_PHASE_OPEN, "pb", "phase_open A|B|C 0|1"},
    {"phase_swap", EVENT_PHASE_SWAP, "Q", "phase_swap AB|BC|CA|off"},
    {"chopper", EVENT_CHOPPER, "b", "chopper 0|1"},
    {"end", EVENT_END, "", "end"},
    {"fabric_other", EVENT_FABRIC_OTHER, "b", "fabric_other 0|1"},
    {"fabric_sealed", EVENT_FABRIC_SEALED, "b", "fabric_sealed 0|1"},
    {"fabric_sealed_behind", EVENT_FABRIC_SEALED_BEHIND, "w",
     "fabric_sealed_behind OFFSET (that may be read once more)"},
    {"fabric_hangs", EVENT_FABRIC_HANGS, "b", "fabric_hangs 0|1"},
    {"flash_bits", EVENT_FLASH_BITS, "aw", "flash_bits OFFSET WORD (of SYSREG, from the next reset on)"},
    {"pll_lost", EVENT_PLL_LOST, "b", "pll_lost 0|1"},
    {"fabric_pll_lost", EVENT_FABRIC_PLL_LOST, "b", "fabric_pll_lost 0|1"},
    {"memory_error", EVENT_MEMORY_ERROR, "b", "memory_error 0|1 (1: it cannot be corrected)"},
    {"lockup_reset", EVENT_LOCKUP_RESET, "", "lockup_reset"},
    {"soft_reset", EVENT_SOFT_RESET, "", "soft_reset"},
    {"user_reset", EVENT_USER_RESET, "", "user_reset (from outside, by MSS_RESET_N_F2M)"},
    {"openocd", EVENT_OPENOCD, "", "openocd (a reset by its script for this device, as it leaves the chip)"},
    {"put_back", EVENT_PUT_BACK, "", "put_back (as traffic on FIC_0 does it on an M2S010)"},
    {"poke", EVENT_POKE, "aw", "poke ADDRESS WORD"},
    {"poke_rom", EVENT_POKE_ROM, "ah", "poke_rom ADDRESS HALFWORD"},
    {"poke_offset", EVENT_POKE_OFFSET, "aw", "poke_offset ADDRESS ADDRESS_OF_ANGLE"},
};

static bool number(const char *word, double min, double max, double *value)
{
    char *end;
    *value = strtod(word, &end);
    return *word && *end == '\0' && isfinite(*value) && *value >= min && *value <= max;
}

static bool integer(const char *word, double max, uint32_t *value)
{
    char *end;
    unsigned long long whole = strtoull(word, &end, 0);
    *value = (uint32_t)whole;
    return isdigit((unsigned char)*word) && *end == '\0' && (double)whole <= max;
}

static bool terminals(const char *word, struct event *e)
{
    static const char *const pairs[] = {"AB", "BC", "CA"};
    for (int n = 0; n < 3; n++) {
        if (strcmp(word, pairs[n]) == 0) {
            e->phase = n;
            e->other_phase = (n + 1) % 3;
            return true;
        }
    }
    return false;
}

static bool order(const char *word, struct event *e)
{
    int seen = 0;
    for (int k = 0; k < 3 && word[k] >= 'A' && word[k] <= 'C'; k++) {
        e->order[k] = word[k] - 'A';
        seen |= 1 << e->order[k];
    }
    return seen == 7 && word[3] == '\0';
}

static bool argument(char type, const char *word, struct event *e)
{
    uint32_t whole;
    e->on = true;
    switch (type) {
    case 'n':
        return number(word, -1e5, 1e5, &e->number);
    case 'y':
        return number(word, -1e5, 1e5, &e->second);
    case 'z':
        return number(word, -1e5, 1e5, &e->third);
    case 's':
        return number(word, 0, 1e6, &e->number);
    case 'i':
        return number(word, -1e9, 1e9, &e->number) && e->number == floor(e->number);
    case 'b':
        e->on = strcmp(word, "1") == 0;
        return e->on || strcmp(word, "0") == 0;
    case 'p':
        e->phase = word[0] - 'A';
        return word[0] >= 'A' && word[0] <= 'C' && word[1] == '\0';
    case 'S':
        e->phase = word[0] - 'A';
        return (word[0] == 'A' || word[0] == 'B') && word[1] == '\0';
    case 'q':
        return terminals(word, e);
    case 'O':
        return order(word, e);
    case 'Q':
        e->on = strcmp(word, "off") != 0;
        return !e->on || terminals(word, e);
    case 'r':
    case 'c':
    case 'T':
        if (strcmp(word, "off") == 0) {
            e->on = false;
            return true;
        }
        if (type == 'r') {
            return number(word, 1e-4, 100, &e->number);
        }
        if (type == 'T') {
            return number(word, -100, 300, &e->number);
        }
        if (!integer(word, 4095, &whole)) {
            return false;
        }
        e->number = whole;
        return true;
    case 'f':
        return number(word, 1e-3, 1, &e->fraction);
    case 'x':
        return strcmp(word, "off") == 0;
    case 'a':
        return integer(word, UINT32_MAX, &e->address);
    case 'w':
        return integer(word, UINT32_MAX, &e->word);
    case 'h':
        return integer(word, UINT16_MAX, &e->word);
    default:
        return false;
    }
}

static bool arguments(const char *types, const char *line, struct event *e)
{
    char copy[256];
    if (types[0] == 't') {
        e->text = strdup(line); /* an empty line is one, too */
        return e->text != NULL;
    }
    if ((size_t)snprintf(copy, sizeof copy, "%s", line) >= sizeof copy) {
        return false;
    }
    char *rest = copy, *word;
    while ((word = strsep(&rest, " \t")) != NULL) {
        if (*word == '\0') {
            continue;
        }
        if (*types == '\0' || !argument(*types++, word, e)) {
            return false;
        }
    }
    return *types == '\0';
}

const char *event_parse(const char *line, struct event *event)
{
    static char message[160];
    size_t length = strcspn(line, " \t");
    for (size_t n = 0; n < sizeof kinds / sizeof kinds[0]; n++) {
        const struct syntax *s = &kinds[n];
        if (strlen(s->name) == length && strncmp(line, s->name, length) == 0) {
            event->kind = s->kind;
            line += length;
            line += strspn(line, " \t");
            if (arguments(s->arguments, line, event)) {
                return NULL;
            }
            snprintf(message, sizeof message, "wrong arguments, expected: %s", s->usage);
            return message;
        }
    }
    snprintf(message, sizeof message, "unknown event '%.*s'", (int)(length > 40 ? 40 : length), line);
    return message;
}

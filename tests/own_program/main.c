/* SPDX-License-Identifier: MIT */
/*
 * A program that uses the transform library and nothing else of this project: it turns a current vector through Clarke,
 * Park and back, prints what it gets, and judges it. docs/library.md says how to build it. C99 and later, and C++.
 */
#include <stdint.h>

#include "Lib.h"

#define AMPLITUDE 10000 /* of the phase currents, mA */
#define LIMIT     2     /* what rounding adds up to on the way there and back, mA */

#if LIB_TRIG_FRAC > 29
#error "the table of this program has 30 fraction bits, of which one is for rounding"
#endif

/* ---- the console: MMUART_0, a 16550, after reset; 115200 baud from 100 MHz, 8N1 ---- */

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define SOFT_RESET_CR     REGISTER(0x40038048u) /* SYSREG; bit 7: MMUART_0 */
#define UART_THR          REGISTER(0x40000000u) /* with LCR bit 7: divisor, low byte */
#define UART_IER          REGISTER(0x40000004u) /* with LCR bit 7: divisor, high byte */
#define UART_LCR          REGISTER(0x4000000Cu)
#define UART_LSR          REGISTER(0x40000014u)
#define LCR_8N1           0x03u
#define LCR_DIVISOR       0x80u
#define LSR_TAKES_MORE    0x20u
#define DIVISOR           54u

static void console_start(void)
{
    SOFT_RESET_CR &= ~(1u << 7);
    UART_LCR = LCR_DIVISOR | LCR_8N1;
    UART_THR = DIVISOR;
    UART_IER = 0u;
    UART_LCR = LCR_8N1;
}

static void put(char character)
{
    while ((UART_LSR & LSR_TAKES_MORE) == 0u) {
    }
    UART_THR = (uint8_t)character;
}

static void print(const char *text)
{
    while (*text != '\0') {
        put(*text++);
    }
}

/* Right-aligned in a column of 12. */
static void print_number(int32_t value)
{
    char text[13];
    uint32_t rest = value < 0 ? 0u - (uint32_t)value : (uint32_t)value;
    int at = 12;

    text[at] = '\0';
    do {
        text[--at] = (char)('0' + (int)(rest % 10u));
        rest /= 10u;
    } while (rest != 0u);
    if (value < 0) {
        text[--at] = '-';
    }
    for (int blanks = at; blanks > 0; blanks--) {
        put(' ');
    }
    print(text + at);
}

/* ---- the transforms ---- */

/* Sines of 0, 30, 60 and 90 degrees with 30 fraction bits, and those of all multiples of 30 degrees from them. */
static int32_t sine(int step)
{
    static const int32_t quarter_q30[] = {0, 536870912, 929887697, 1073741824};
    const int in_turn = step % 12;
    const int in_half = in_turn % 6;
    const int32_t q30 = quarter_q30[in_half > 3 ? 6 - in_half : in_half];
    const int32_t fraction = ((q30 >> (29 - LIB_TRIG_FRAC)) + 1) >> 1;

    return in_turn < 6 ? fraction : -fraction;
}

static int32_t cosine(int step)
{
    return sine(step + 3);
}

/* A phase current, rounded. AMPLITUDE times a fraction of 15 bits fits 32 bits. */
static int32_t phase_current(int step)
{
    const int32_t fraction_q14 = cosine(step) / (1 << (LIB_TRIG_FRAC - 14));

    return (AMPLITUDE * fraction_q14 + (1 << 13)) >> 14;
}

static int near_to(int32_t value, int32_t expected)
{
    return value - expected <= LIMIT && expected - value <= LIMIT;
}

/* The current vector at `step` times 30 degrees, seen by a rotor at the same angle: all of it is d. */
static int turn(int step)
{
    clarkeinput_type phases;
    clarkeoutput_type fixed;
    parkinput_type seen;
    parkoutput_type rotor;
    invparkinput_type back;
    invparkoutput_type turned;
    invclarkeinput_type two;
    invclarkeoutput_type three;

    phases.ia = phase_current(step);
    phases.ib = phase_current(step + 8); /* 120 degrees behind */
    phases.ic = 0;                       /* not read: the currents are balanced */
    Clarke_Lib_Do(&phases, &fixed);

    seen.ialpha = fixed.ialpha;
    seen.ibeta = fixed.ibeta;
    seen.cos = cosine(step);
    seen.sin = sine(step);
    Park_Lib_Do(&seen, &rotor);

    back.vd = rotor.id;
    back.vq = rotor.iq;
    back.cos = seen.cos;
    back.sin = seen.sin;
    InvPark_Lib_Do(&back, &turned);

    two.valpha = turned.valpha;
    two.vbeta = turned.vbeta;
    InvClarke_Lib_Do(&two, &three);

    print_number(phases.ia);
    print_number(phases.ib);
    print_number(rotor.id);
    print_number(rotor.iq);
    print_number(three.va);
    print_number(three.vb);
    print_number(three.vc);
    print("\r\n");
    return near_to(rotor.id, AMPLITUDE) && near_to(rotor.iq, 0) && near_to(three.va, phases.ia) &&
           near_to(three.vb, phases.ib) && near_to(three.va + three.vb + three.vc, 0);
}

/* What does not fit is limited, with its sign. */
static int saturates(int32_t current, int32_t expected)
{
    clarkeinput_type phases;
    clarkeoutput_type fixed;

    phases.ia = current;
    phases.ib = current;
    phases.ic = 0;
    Clarke_Lib_Do(&phases, &fixed);
    print("saturated   ");
    print_number(phases.ib);
    print_number(fixed.ibeta);
    print("\r\n");
    return fixed.ialpha == current && fixed.ibeta == expected;
}

int main(void)
{
    int good = 1;

    console_start();
    print("          ia          ib          id          iq          va          vb          vc\r\n");
    for (int step = 0; step < 12; step++) {
        good &= turn(step);
    }
    good &= saturates(INT32_MAX, INT32_MAX);
    good &= saturates(INT32_MIN, INT32_MIN);
    print(good ? "own program: passed\r\n" : "own program: failed\r\n");
    return good ? 0 : 1;
}

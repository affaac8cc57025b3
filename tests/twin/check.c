/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "check.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>

static int passed, failed;

static bool count(const char *name, bool good)
{
    if (good) {
        printf("ok %s\n", name);
        passed++;
    } else {
        printf("FAIL %s: ", name);
        failed++;
    }
    return good;
}

void check_true(const char *name, bool good)
{
    if (!count(name, good)) {
        printf("expected true got false\n");
    }
}

void check_equal(const char *name, int64_t got, int64_t expected)
{
    if (!count(name, got == expected)) {
        printf("expected %" PRId64 " got %" PRId64 "\n", expected, got);
    }
}

void check_hex(const char *name, uint32_t got, uint32_t expected)
{
    if (!count(name, got == expected)) {
        printf("expected 0x%" PRIX32 " got 0x%" PRIX32 "\n", expected, got);
    }
}

void check_near(const char *name, double got, double expected, double tolerance)
{
    if (!count(name, fabs(got - expected) <= tolerance)) {
        printf("expected %.9g within %.3g got %.9g\n", expected, tolerance, got);
    }
}

void check_between(const char *name, double got, double low, double high)
{
    if (!count(name, got >= low && got <= high)) {
        printf("expected %.9g...%.9g got %.9g\n", low, high, got);
    }
}

int check_end(void)
{
    printf("%d passed, %d failed\n", passed, failed);
    return failed != 0;
}

/* xorshift32 (G. Marsaglia, "Xorshift RNGs", 2003); not the twin's own generator, which is under test. */
uint32_t any_u32(void)
{
    static uint32_t state = 20260101;
    state ^= state << 13;
    state ^= state >> 17;
    state ^= state << 5;
    return state;
}

int any_between(int low, int high)
{
    return low + (int)(any_u32() % (uint32_t)(high - low + 1));
}

double any_real(double low, double high)
{
    return low + (high - low) * any_u32() / UINT32_MAX;
}

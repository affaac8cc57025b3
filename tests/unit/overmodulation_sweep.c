/* SPDX-License-Identifier: MIT */
/*
 * What the modulator makes of voltages from nothing to six-step: for each length that the controllers ask for, the fundamental
 * of the compares over a turn, its angle, and the fifth and seventh harmonics; and how far the compares are from those of the
 * circle's modulator. In shares of six-step's fundamental.
 */
#include <complex.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "firmware/control/current_loop_step.h"
#include "lib/trig.h"

#define ANGLES 3600
#define TWO_PI 6.283185307179586

struct sums {
    double complex of[8];
    int farthest;
};

static int apart(uint32_t a, uint32_t b)
{
    return a > b ? (int)(a - b) : (int)(b - a);
}

static int farthest_of(const struct pwm_regs *a, const struct pwm_regs *b)
{
    const int first = apart(a->COMPARE_A, b->COMPARE_A);
    const int second = apart(a->COMPARE_B, b->COMPARE_B);
    const int third = apart(a->COMPARE_C, b->COMPARE_C);
    return first > second ? (first > third ? first : third) : (second > third ? second : third);
}

/* A phase of the star by compares: its own less the mean of all, of the bus. */
static double phase(const struct pwm_regs *pwm)
{
    const double mean = ((double)pwm->COMPARE_A + pwm->COMPARE_B + pwm->COMPARE_C) / 3;
    return (pwm->COMPARE_A - mean) / CONFIG_HALF_COUNTS;
}

static struct sums turn(int32_t length_steps)
{
    struct sums s = {.farthest = 0};
    static union {
        struct pwm_regs regs;
        uint32_t words[sizeof(struct pwm_regs) / 4];
    } beyond, within;
    for (int n = 0; n < ANGLES; n++) {
        const uint32_t angle_q32 = (uint32_t)(4294967296.0 * (n + 0.5) / ANGLES);
        const cossin_t cs = cossin_q15(angle_q32);
        overmodulate(&beyond.regs, (dq_t){length_steps, 0}, cs, (alphabeta_t){0, 0}, 0);
        if (length_steps <= CONFIG_RADIUS_STEPS) {
            modulate(&within.regs, (dq_t){length_steps, 0}, cs, (alphabeta_t){0, 0}, 0);
            const int off = farthest_of(&beyond.regs, &within.regs);
            s.farthest = off > s.farthest ? off : s.farthest;
        }
        for (int k = 1; k < 8; k++) {
            s.of[k] += 2 * phase(&beyond.regs) * cexp(-I * k * TWO_PI * (n + 0.5) / ANGLES) / ANGLES;
        }
    }
    return s;
}

int main(void)
{
    for (int part = 1; part <= 200; part++) {
        const int32_t length_steps = (int32_t)((int64_t)CONFIG_SIX_STEPS * part / 200);
        const struct sums s = turn(length_steps);
        const double six = 2 / (TWO_PI / 2);
        printf("%.6f %.6f %.6f %.6f %.6f %d\n", length_steps / (double)CONFIG_BUS_STEPS / six, cabs(s.of[1]) / six,
               carg(s.of[1]), cabs(s.of[5]) / six, cabs(s.of[7]) / six, s.farthest);
    }
    return 0;
}

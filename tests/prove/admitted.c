/* SPDX-License-Identifier: MIT */
/*
 * What of struct current_loop the interrupt's proof takes as given, and what it is in truth: the numbers of the build, the
 * circle's table, and the extremes of what tuning and slow loop write, over a random walk through all parameters that are
 * admitted. One "name low high" a line; read by tests/prove/admitted.py.
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/board.h"
#include "firmware/control/current_loop.h"
#include "firmware/settings/config.h"
#include "lib/pi.h"

uint32_t host_primask; /* the core's, of tests/unit/host: nothing interrupts here */

struct span {
    const char *name;
    int32_t low, high;
};

enum member { KP_D, KP_Q, KI, TURN, FEEDFORWARD_D, FEEDFORWARD_Q, I_REF, DEAD_SHIFT, MEMBERS };

static struct span spans[MEMBERS] = {
    {"kp_d_q9", INT32_MAX, INT32_MIN},
    {"kp_q_q9", INT32_MAX, INT32_MIN},
    {"ki_q15", INT32_MAX, INT32_MIN},
    {"turn_q15", INT32_MAX, INT32_MIN},
    {"feedforward_d_steps", INT32_MAX, INT32_MIN},
    {"feedforward_q_steps", INT32_MAX, INT32_MIN},
    {"i_ref", INT32_MAX, INT32_MIN},
    {"dead_shift", INT32_MAX, INT32_MIN}, /* while the handler by hand serves */
};

static void see(enum member member, int32_t value)
{
    struct span *const s = &spans[member];
    s->low = value < s->low ? value : s->low;
    s->high = value > s->high ? value : s->high;
}

static uint64_t state = 0x9E3779B97F4A7C15u;

static uint32_t next(void)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (uint32_t)(state >> 16);
}

static int32_t between(int32_t low, int32_t high)
{
    return (int32_t)(low + (int64_t)(next() % ((uint64_t)high - (uint64_t)low + 1u)));
}

/* An end, a value of any magnitude, or one near the present. */
static int32_t another(const struct param_info *info, int32_t present)
{
    const int64_t wide = (int64_t)info->min + (((int64_t)info->max - info->min) >> (next() % 31u));
    const int64_t near = (int64_t)present * (64 + (int64_t)(next() % 128u)) / 128 + (int64_t)(next() % 3u) - 1;
    const int64_t choices[] = {wide, near, near, near, info->min, info->max};
    const int64_t chosen = choices[next() % 6u];
    return (int32_t)(chosen < info->min ? info->min : chosen > info->max ? info->max : chosen);
}

static void follow(struct current_loop *c, struct fabric *f, const struct tuning *t)
{
    uint32_t *const vbus = (uint32_t *)(uintptr_t)&f->adc.VBUS;
    *vbus = (uint32_t)between(0, 32760);
    c->source = next() % 4u == 0u ? LOOP_FORCED : LOOP_ENCODER;
    c->pll.speed_q32 = (int32_t)next();
    c->field_speed_q32 = (int32_t)next();
    c->i_d_ref_q15 = between(-t->i_max_q15, t->i_max_q15);
    c->i_q_ref_q15 = next() % 4u == 0u ? 0 : between(-t->i_max_q15, t->i_max_q15);
    c->i_q_q15 = between(-65535, 65535);
    c->v_d_steps = between(-LOOP_V_D_MAX_STEPS, LOOP_V_D_MAX_STEPS - 1);
    c->v_q_steps = between(-CONFIG_RADIUS_STEPS, CONFIG_RADIUS_STEPS);
    current_loop_follow(c, f, t);
}

static void see_loop(const struct current_loop *c, const struct tuning *t)
{
    see(KP_D, c->kp_d_q9);
    see(KP_Q, c->kp_q_q9);
    see(KI, c->ki_q15);
    see(TURN, c->turn_q15);
    see(FEEDFORWARD_D, c->feedforward_d_steps);
    see(FEEDFORWARD_Q, c->feedforward_q_steps);
    see(I_REF, t->i_max_q15);
    see(I_REF, -t->i_max_q15);
    if (c->ripple_q10 == 0) {
        see(DEAD_SHIFT, (int32_t)c->dead_shift);
    }
}

static struct current_loop loop;
static struct fabric fabric;

static void try(const struct tuning *t)
{
    current_loop_tune(&loop, t);
    current_loop_on(&loop, &fabric, t);
    see_loop(&loop, t);
    for (int n = 0; n < 8; n++) {
        follow(&loop, &fabric, t);
        see_loop(&loop, t);
    }
    current_loop_off(&loop, &fabric);
    see_loop(&loop, t);
}

static void walk(uint32_t steps)
{
    struct params p;
    struct tuning t;
    int32_t admitted = 0;
    params_init(&p);
    for (uint32_t n = 0; n < steps; n++) {
        struct params changed = p;
        for (uint32_t count = 1u + next() % 3u; count > 0u; count--) {
            const struct param_info *const info = &param_table[next() % param_count];
            param_set(&changed, info, another(info, param_get(&changed, info)));
        }
        if (tuning_compute(&changed, &t).error == ERROR_NONE) {
            p = changed;
            admitted++;
            try(&t);
        }
    }
    printf("admitted %" PRId32 " %" PRId32 "\n", admitted, admitted);
}

static void tell(const char *name, int32_t value)
{
    printf("%s %" PRId32 " %" PRId32 "\n", name, value, value);
}

int main(int argc, char **argv)
{
    tell("half", LOOP_HALF);
    tell("dead", LOOP_DEAD);
    tell("compare_shift", LOOP_COMPARE_SHIFT);
    tell("v_d_bits", LOOP_V_D_BITS);
    tell("circle_bits", LOOP_CIRCLE_BITS);
    tell("circle_shift", LOOP_CIRCLE_SHIFT);
    tell("kp_shift", CONFIG_PLL_KP_SHIFT);
    tell("ki_shift", CONFIG_PLL_KI_SHIFT);
    tell("half_counts", CONFIG_HALF_COUNTS);
    tell("taken_counts", CONFIG_DEAD_COUNTS + CONFIG_MIN_PULSE_COUNTS); /* of each side's time: not less is left */
    tell("kp_max", PI_KP_MAX_Q9);
    tell("ki_max", PI_KI_MAX_Q15);
    tell("bus_steps", CONFIG_BUS_STEPS);
    tell("fabric_base", FABRIC_BASE);
    tell("adc_status_cleared", ADC_STATUS_EOC | ADC_STATUS_OVERRUN | ADC_STATUS_TRIP);
    tell("adc_status_taken", ADC_STATUS_EOC);
    tell("circle_offset", (int32_t)LOOP_CIRCLE);
    tell("COMPARE_A", FABRIC_COMPARE_A);
    tell("COMPARE_B", FABRIC_COMPARE_B);
    tell("COMPARE_C", FABRIC_COMPARE_C);
    tell("ADC_STATUS", FABRIC_ADC_STATUS);
    tell("IA", FABRIC_ADC_IA);
    tell("IB", FABRIC_ADC_IB);
    tell("LATCHED", FABRIC_ENC_LATCHED);
    tell("GATE_STATUS", FABRIC_GATE_STATUS);
    tell("turn_max", LOOP_TURN_MAX_Q15);
    tell("integral_max", PI_INTEGRAL_MAX_Q9);
    current_loop_init(&loop);
    walk(argc > 1 ? (uint32_t)strtoul(argv[1], NULL, 0) : 1000u);
    for (int n = 0; n < MEMBERS; n++) {
        printf("%s %" PRId32 " %" PRId32 "\n", spans[n].name, spans[n].low, spans[n].high);
    }
    for (int n = 0; n < 1 << LOOP_CIRCLE_BITS; n++) {
        printf("circle %u %u\n", loop.circle_steps[n], loop.circle_steps[n]);
    }
    return 0;
}

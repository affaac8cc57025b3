/* SPDX-License-Identifier: MIT */
/* The current loop's interrupts, and what waits for their samples. */
#include "firmware/commission/pulses.h"
#include "firmware/control/bridge.h"
#include "firmware/control/current_loop_step.h"
#include "swarm.h"

#define CLOCK_S 10e-9

uint32_t samples_taken;
static void (*vectors[AXIS_COUNT])(void);
static uint32_t sampling; /* the axis whose interrupt it is */

/* What it stores to ADC.STATUS clears the end of the conversion alone. */
#define HANDLER(name, step) \
    static void name(void) \
    { \
        struct axis *const a = &world.axes[sampling]; \
        struct fabric *const f = &world.fabrics[sampling]; \
        const uint32_t flags = f->adc.STATUS & ~ADC_STATUS_EOC; \
        const bool fault = step; \
        f->adc.STATUS = flags; \
        if (fault) { \
            drive_sample_fault(a); \
        } \
    }
HANDLER(encoder, current_loop_step(&a->loop, f, LOOP_ENCODER))
HANDLER(forced, current_loop_step(&a->loop, f, LOOP_FORCED))
HANDLER(observer, current_loop_step(&a->loop, f, LOOP_OBSERVER))
HANDLER(injection, current_loop_step(&a->loop, f, LOOP_INJECTION))
HANDLER(hall, current_loop_step_hall(&a->loop, &a->hall, f))
HANDLER(weakening, current_loop_step_weakening(&a->loop, f, false))
HANDLER(overmodulating, current_loop_step_weakening(&a->loop, f, true))

static struct loop_handlers handlers[AXIS_COUNT];
static const struct loop_handlers handlers_of_all = {.handler = {[LOOP_ENCODER] = encoder,
                                                                 [LOOP_FORCED] = forced,
                                                                 [LOOP_OBSERVER] = observer,
                                                                 [LOOP_INJECTION] = injection,
                                                                 [LOOP_HALL] = hall},
                                                     .weakening = weakening,
                                                     .overmodulating = overmodulating,
                                                     .rippled = encoder};

/* Gates that open and shut within a millisecond are seen, too. */
void samples_look_at_gates(void)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        struct fabric *const f = &world.fabrics[n];
        const bool before = (f->gate.STATUS & GATE_STATUS_LIVE) != 0u;
        if (before != (f->gate.CONTROL != 0u)) {
            plant_gate(&world.plants[n], f);
        }
    }
}

void __sanitizer_cov_trace_pc(void) __attribute__((alias("samples_look_at_gates")));

void samples_take(void)
{
    for (uint32_t n = 0; n < AXIS_COUNT; n++) {
        plant_period(&world.plants[n], &world.fabrics[n]);
        sampling = n;
        vectors[n]();
        samples_look_at_gates();
    }
    samples_taken++;
}

const struct loop_handlers *samples_handlers(uint32_t n)
{
    handlers[n] = handlers_of_all;
    handlers[n].vector = &vectors[n];
    vectors[n] = encoder;
    return &handlers[n];
}

/* ---- the slow loop waits ---- */

static uint32_t number_of(const struct fabric *f)
{
    return (uint32_t)(f - world.fabrics);
}

void emf_pulse_wait(const struct fabric *f, uint32_t samples)
{
    (void)f;
    while (samples-- > 0u) {
        samples_take();
    }
}

static struct emf_pulse short_pulse(const volatile struct current_loop *c, struct fabric *f, double seconds)
{
    samples_take();
    if (bridge_enable(c, f)) {
        samples_look_at_gates();
        plant_short(&world.plants[number_of(f)], f, seconds);
    }
    gate_disable(&f->gate);
    samples_look_at_gates();
    return (struct emf_pulse){.sequence = f->adc.SEQUENCE, .i = clarke_q15(f->adc.IA, f->adc.IB)};
}

struct emf_pulse emf_pulse(const volatile struct current_loop *c, struct fabric *f, uint32_t counts)
{
    return short_pulse(c, f, counts * CLOCK_S);
}

struct emf_pulse emf_pulse_period(const volatile struct current_loop *c, struct fabric *f, uint32_t samples)
{
    return short_pulse(c, f, samples * CONFIG_PWM_COUNTS * CLOCK_S);
}

/* SPDX-License-Identifier: MIT */
/*
 * What only physics can decide, how a phase of the start or a search ends, an event decides; and what a monitor sees. These
 * functions come before the library's own.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>

#include "adapter.h"
#include "firmware/commission/pulses.h"
#include "firmware/control/bridge.h"
#include "firmware/drive/states.h"
#include "world.h"

#define SPEED_Q32 (1 << 23) /* of a rotor that is caught */

static struct axis *const a = &world.axis;

#define PHASE(type, name, parameters, arguments, well, badly, otherwise, worst) \
    type name parameters \
    { \
        static type(*real) parameters; \
        static const type results[] = {(type)0, well, badly, otherwise, worst}; \
        if (real == NULL) { \
            *(void **)&real = dlsym(RTLD_NEXT, #name); \
        } \
        return world.forced == AS_IT_DOES ? real arguments : results[world.forced]; \
    }

PHASE(enum calibration_result, calibration_step, (struct calibration * k, struct adc_regs *adc), (k, adc),
      CALIBRATION_DONE, CALIBRATION_OUT_OF_RANGE, CALIBRATION_DONE, CALIBRATION_DONE)
PHASE(enum wiring_result, wiring_step,
      (struct wiring * w, volatile struct current_loop *c, const struct tuning *t, const struct adc_regs *adc),
      (w, c, t, adc), WIRING_GOOD, WIRING_OPEN, WIRING_SIGN, WIRING_EXCHANGED)
PHASE(enum alignment_result, alignment_step,
      (struct alignment * m, volatile struct current_loop *c, const struct tuning *t, uint32_t latched),
      (m, c, t, latched), ALIGNMENT_DONE, ALIGNMENT_LOAD, ALIGNMENT_ENCODER_DEAD, ALIGNMENT_COUNTS)
PHASE(enum offset_result, offset_check_step,
      (struct offset_check * o, volatile struct current_loop *c, const struct tuning *t, uint32_t latched),
      (o, c, t, latched), OFFSET_RIGHT, OFFSET_WRONG, OFFSET_UNKNOWN, OFFSET_WRONG)
PHASE(enum injection_result, injection_start_step, (struct axis * axis), (axis), INJECTION_DONE, INJECTION_SALIENCY,
      INJECTION_POLARITY, INJECTION_POLARITY)
PHASE(bool, sensorless_align, (struct axis * axis), (axis), true, false, false, false)
PHASE(enum hall_learn_result, hall_learn_step,
      (struct hall_learn * l, volatile struct current_loop *c, const struct encoder_regs *e, const struct tuning *t),
      (l, c, e, t), HALL_LEARN_DONE, HALL_LEARN_BLOCKED, HALL_LEARN_UNCLEAR, HALL_LEARN_LOAD)
PHASE(bool, identify_step, (struct identify * d, const struct measure_io *io), (d, io), true, false, false, false)
PHASE(bool, identify_takes_over, (const struct identify *d), (d), false, true, false, false)
PHASE(enum homing_result, homing_step, (struct homing * h, const struct homing_view *v), (h, v), HOMING_FOUND,
      HOMING_FAILED, HOMING_FAILED, HOMING_FAILED)

enum flying_result flying_step(struct axis *axis)
{
    static enum flying_result (*real)(struct axis *);
    if (real == NULL) {
        *(void **)&real = dlsym(RTLD_NEXT, "flying_step");
    }
    if (world.forced == WELL) {
        flying_resume(axis, 0x12345678u, SPEED_Q32);
        return FLYING_CAUGHT;
    }
    return world.forced == AS_IT_DOES ? real(axis) : FLYING_STANDS;
}

/* Which rows of the table have been taken: from, event, to. */
static uint32_t rows[AXIS_FAULT + 1][DRIVE_EVENT_GATES_SHUT + 1][AXIS_FAULT + 1];

bool states_take(struct axis *axis, enum drive_event event)
{
    static bool (*real)(struct axis *, enum drive_event);
    const uint32_t from = axis->state;
    if (real == NULL) {
        *(void **)&real = dlsym(RTLD_NEXT, "states_take");
    }
    const bool taken = real(axis, event);
    rows[from][event][axis->state] += taken ? 1u : 0u;
    return taken;
}

void explore_print_rows(void)
{
    for (int n = 0; n < (int)(sizeof rows / sizeof rows[0][0][0]); n++) {
        const int to = n % (AXIS_FAULT + 1), event = n / (AXIS_FAULT + 1) % (DRIVE_EVENT_GATES_SHUT + 1);
        const int from = n / (AXIS_FAULT + 1) / (DRIVE_EVENT_GATES_SHUT + 1);
        if (rows[from][event][to] != 0u) {
            printf("  row %d %d %d\n", from, event, to);
        }
    }
}

/* No sample comes while the slow loop waits on this machine. */
void emf_pulse_wait(const struct fabric *f, uint32_t samples)
{
    volatile uint32_t *const sequence = (volatile uint32_t *)(uintptr_t)&f->adc.SEQUENCE;
    *sequence += samples;
    a->heartbeat += samples; /* of the same millisecond */
}

struct emf_pulse emf_pulse(const volatile struct current_loop *c, struct fabric *f, uint32_t counts)
{
    (void)counts;
    (void)bridge_enable(c, f);
    gate_disable(&f->gate);
    return (struct emf_pulse){.sequence = f->adc.SEQUENCE};
}

struct emf_pulse emf_pulse_period(const volatile struct current_loop *c, struct fabric *f, uint32_t samples)
{
    return emf_pulse(c, f, samples);
}

/* ---- monitors ---- */

bool world_has_sensor_for(int32_t cause)
{
    const bool runs = a->state == AXIS_OPERATION_ENABLED || a->state == AXIS_QUICK_STOP;
    if (cause == FAULT_ENCODER_SLIP || cause == FAULT_ENCODER_COUNTS) {
        return runs && rotor_has_encoder(a);
    }
    return runs &&
           (cause == FAULT_HALL_SEQUENCE ? rotor_has_hall(a) : cause != FAULT_LOCK_LOST || !rotor_has_encoder(a));
}

/* As a monitor does it, if it still looks by then. */
void supervision_step(struct axis *axis)
{
    static void (*real)(struct axis *);
    if (real == NULL) {
        *(void **)&real = dlsym(RTLD_NEXT, "supervision_step");
    }
    real(axis);
    if (world.report != FAULT_NONE && world_has_sensor_for((int32_t)world.report)) {
        fault_report(axis, (enum fault)world.report, 0, 0);
    }
}

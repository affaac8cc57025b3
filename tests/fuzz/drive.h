/* SPDX-License-Identifier: MIT */
/* What the fuzzers share: a drive at rest, the input's bytes, and what must hold. */
#ifndef TESTS_FUZZ_DRIVE_H
#define TESTS_FUZZ_DRIVE_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/drive/drive.h"
#include "firmware/drive/nvm.h"
#include "tests/unit/host/envm.h"

#define PUT(reg, value) (*(volatile uint32_t *)(uintptr_t) & (reg) = (uint32_t)(value))

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t count);

/* The fuzzer shows the input behind this line, and keeps it. */
#define HOLDS(truth, ...) \
    do { \
        if (!(truth)) { \
            fprintf(stderr, "does not hold: " __VA_ARGS__); \
            fprintf(stderr, "\n"); \
            abort(); \
        } \
    } while (0)

/* How often something came up that is judged, for the test to see that it is: "seen NAME COUNT" at the end. */
static struct {
    const char *name;
    unsigned long count;
} seen[16];

static inline void see(const char *name)
{
    size_t n = 0;
    while (seen[n].name != NULL && seen[n].name != name) {
        n++;
    }
    seen[n].name = name;
    seen[n].count++;
}

__attribute__((destructor)) static void tell(void)
{
    for (size_t n = 0; seen[n].name != NULL; n++) {
        printf("seen %s %lu\n", seen[n].name, seen[n].count);
    }
}

/* What is left of the input; bytes behind its end are 0. */
struct input {
    const uint8_t *at, *end;
};

static inline uint8_t next_byte(struct input *in)
{
    return in->at < in->end ? *in->at++ : 0u;
}

static struct fabric fabric;
static struct axis axis;
static struct slots slots;

static inline void begin_drive(bool on)
{
    memset(&fabric, 0, sizeof fabric);
    memset(&axis, 0, sizeof axis);
    drive_init(&axis, &fabric);
    PUT(fabric.gate.ID, GATE_ID);
    axis.fabric_untrusted = 0;
    axis.state = on ? AXIS_OPERATION_ENABLED : AXIS_SWITCH_ON_DISABLED;
    axis.time_ms = 1000;
    host_envm_new(&axis, 8e-3, 1);
    slots = host_slots();
}

/* The rest of the thread's turn, and what the slow loop then takes. */
static inline void take_turn(void)
{
    set_point_take(&axis);
    while (drive_prepare(&axis)) {
    }
}

static inline void check_ranges(void)
{
    for (size_t n = 0; n < param_count; n++) {
        const int32_t value = param_get(&axis.params, &param_table[n]);
        HOLDS(value >= param_table[n].min && value <= param_table[n].max, "%s is in its range", param_table[n].name);
    }
}

/* What only a command that is carried out may change. */
struct told {
    struct params params;
    uint8_t choice[FAULT_COUNT];
    uint32_t request, state, mode;
    bool waits;
    int32_t target_rpm_q16, torque_command_q15;
};

static inline struct told told(void)
{
    struct told t;
    memset(&t, 0, sizeof t); /* compared byte by byte */
    t.params = axis.params;
    memcpy(t.choice, axis.reactions.choice, sizeof t.choice);
    t.request = axis.request;
    t.state = axis.state;
    t.mode = axis.mode;
    t.waits = axis.set_point.waits;
    t.target_rpm_q16 = axis.speed.target_rpm_q16;
    t.torque_command_q15 = axis.torque_command_q15;
    return t;
}

static inline bool same(const struct told *a, const struct told *b)
{
    return memcmp(a, b, sizeof *a) == 0;
}

#endif

/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Fabric slot 3: what stands between CorePWM and the gate drivers (docs/fabric.md). */
#ifndef TWIN_GATE_H
#define TWIN_GATE_H

#include <stdbool.h>
#include <stdint.h>

enum gate_latch {
    GATE_OVERCURRENT = 1u << 1,
    GATE_DRIVER_FAULT = 1u << 2,
    GATE_LOOP_LOST = 1u << 3,
    GATE_INTERLOCK = 1u << 4,
};

struct gate {
    uint32_t id_xor; /* not 0: another design */
    bool enabled;
    uint32_t latches;
    /* inputs as they are now */
    bool overcurrent, driver_fault, both_sides;
    bool encoder_faulty, adc_overran, adc_beyond_limit; /* shown, without an effect */
};

void gate_reset(struct gate *g);
uint32_t gate_read(const struct gate *g, uint32_t offset);
void gate_write(struct gate *g, uint32_t offset, uint32_t value);

/* The six commands of CorePWM; returns what reaches the drivers. */
unsigned gate_follow(struct gate *g, unsigned commands);
void gate_set_overcurrent(struct gate *g, bool active);
void gate_set_driver_fault(struct gate *g, bool active);
void gate_adc_overrun(struct gate *g);
void gate_mirror(struct gate *g, bool encoder_faulty, bool adc_overran, bool adc_beyond_limit);
bool gate_live(const struct gate *g);

#endif

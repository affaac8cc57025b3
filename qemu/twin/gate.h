/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Fabric slot 3: what stands between the PWM and the gate drivers (docs/fabric.md). A pin acts at once; the RTL lets it cut the
 * gates as quickly, and shows it behind two flip-flops. */
#ifndef TWIN_GATE_H
#define TWIN_GATE_H

#include <stdbool.h>
#include <stdint.h>

#include "chopper.h"
#include "watch.h"

enum gate_latch {
    GATE_OVERCURRENT = 1u << 1,
    GATE_DRIVER_FAULT = 1u << 2,
    GATE_LOOP_LOST = 1u << 3,
    GATE_INTERLOCK = 1u << 4,
    GATE_STO_A = 1u << 10,
    GATE_STO_B = 1u << 11,
    GATE_CLOCK_LOST = 1u << 12,
    GATE_SLOW_LOST = 1u << 15,
    GATE_THREAD_LOST = 1u << 16,
    GATE_STO_APART = 1u << 17,
};

struct gate {
    uint32_t id_xor; /* not 0: another design */
    unsigned axis;   /* which this is, from 0 */
    unsigned others; /* axes beside it in the fabric */
    bool in_en;      /* it drives an input and an enable for each leg */
    bool enabled;
    uint32_t latches;
    uint32_t asking; /* the latches whose pins ask to stop now */
    bool both_sides;
    bool encoder_faulty, adc_overran, adc_beyond_limit; /* shown, without an effect */
    struct chopper chopper;
    struct watch watch;
};

void gate_reset(struct gate *g);
uint32_t gate_read(const struct gate *g, uint32_t offset);
void gate_write(struct gate *g, uint32_t offset, uint32_t value, sim_ps now);

/* The six commands of the PWM; returns what reaches the drivers. */
unsigned gate_follow(struct gate *g, unsigned commands);
/* What has a latch asks to stop, or no longer: over-current, driver fault, clock; STO behind its filters. */
void gate_pin(struct gate *g, enum gate_latch which, bool stops);
void gate_adc_overrun(struct gate *g);
/* The PWM has a new set of compares; its carrier passes the valley; the watch's time is over. */
void gate_committed(struct gate *g);
void gate_valley(struct gate *g);
void gate_watch_late(struct gate *g);
void gate_mirror(struct gate *g, bool encoder_faulty, bool adc_overran, bool adc_beyond_limit);
bool gate_live(const struct gate *g);
/* Whether the chopper's gate is on. */
bool gate_chops(const struct gate *g);

#endif

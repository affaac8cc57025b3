/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The vocabulary of scenarios: what can happen to the board, and how a line of the configuration says it. */
#ifndef TWIN_EVENTS_H
#define TWIN_EVENTS_H

#include <stdbool.h>
#include <stdint.h>

enum event_kind {
    EVENT_CONSOLE,
    EVENT_KEYS,
    EVENT_BUS,
    EVENT_CAN,
    EVENT_CAN_BREAK,
    EVENT_CAN_CUT,
    EVENT_LOAD,
    EVENT_LOAD_FAN,
    EVENT_LOAD_COULOMB,
    EVENT_LOAD_HOIST,
    EVENT_LOCK,
    EVENT_SPIN,
    EVENT_SPIN_OFF,
    EVENT_SUPPLY_V,
    EVENT_SUPPLY_SINKS,
    EVENT_SENSOR_ADD,
    EVENT_SENSOR_GAIN,
    EVENT_SENSOR_OFFSET,
    EVENT_SENSOR_STUCK,
    EVENT_SENSOR_ORDER,
    EVENT_SENSOR_SINE,
    EVENT_DRIVER_FAULT,
    EVENT_STO,
    EVENT_SHORT,
    EVENT_WINDING_SHORT,
    EVENT_ENCODER_CUT,
    EVENT_ENCODER_FREEZE,
    EVENT_ENCODER_ILLEGAL,
    EVENT_ENCODER_SLIP,
    EVENT_ENCODER_REVERSE,
    EVENT_HALL_OPEN,
    EVENT_HALL_INVERT,
    EVENT_HALL_SWAP,
    EVENT_TEMPERATURE,
    EVENT_IRQ_DELAY,
    EVENT_IRQ_BLOCK,
    EVENT_WATCHDOG_RESET,
    EVENT_POWER_CUT,
    EVENT_PHASE_OPEN,
    EVENT_PHASE_SWAP,
    EVENT_CHOPPER,
    EVENT_END,
    EVENT_FABRIC_OTHER,
    EVENT_FABRIC_SEALED,
    EVENT_FABRIC_SEALED_BEHIND,
    EVENT_FABRIC_HANGS,
    EVENT_FLASH_BITS,
    EVENT_PLL_LOST,
    EVENT_FABRIC_PLL_LOST,
    EVENT_MEMORY_ERROR,
    EVENT_LOCKUP_RESET,
    EVENT_SOFT_RESET,
    EVENT_USER_RESET,
    EVENT_OPENOCD,
    EVENT_PUT_BACK,
    EVENT_POKE,
    EVENT_POKE_ROM,
    EVENT_POKE_OFFSET,
};

struct event {
    double t_s;
    enum event_kind kind;
    unsigned axis; /* from 0 */
    int phase;     /* or the first of a pair of terminals */
    int other_phase;
    int order[3]; /* of all three */
    bool on;      /* of a 0|1 argument; false for "off" */
    double number;
    double second, third; /* of an event with more numbers */
    double fraction;      /* 0 to 1 */
    uint32_t address, word;
    const char *text; /* for the console; belongs to the event */
};

/* Reads "KIND ARGS..." into *event. Returns NULL, or what is wrong with it. */
const char *event_parse(const char *line, struct event *event);

#endif

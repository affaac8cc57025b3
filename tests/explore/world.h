/* SPDX-License-Identifier: MIT */
/* What adapter.c and events.c share: the drive, what surrounds it, and what its operator has asked for. */
#ifndef TESTS_EXPLORE_WORLD_H
#define TESTS_EXPLORE_WORLD_H

#include "firmware/drive/drive.h"
#include "firmware/operate/cia402.h"
#include "firmware/source/rotor.h"

enum group {
    BASE = 1u,
    FAULTS = 2u,
    SUPPLY = 4u,
    MODES = 8u,
    BUS = 16u,
    SOURCES = 32u,
    MEASURE = 64u,
    PARAMS = 128u,
    REPORTS = 256u,
    STARTS = 512u,
    TURNS = 1024u,
    GATE = 2048u,
    BUS_MODES = 4096u,
    RETRIES = 8192u,
    OWNERS_CHANGE = 16384u,
    BUS_OWNERS = 32768u,
};

/* How a phase ends in a step. */
enum ending { AS_IT_DOES, WELL, BADLY, OTHERWISE, WORST };

enum wish {
    WISH_NONE,
    WISH_OPERATION, /* until off, quick stop, clear, a word without all enable bits */
    WISH_MEASURING, /* until it ends, by a fault, too */
};

struct world {
    struct axis axis;
    struct fabric fabric;
    struct cia402 bus;
    uint32_t wish;   /* enum wish */
    uint32_t forced; /* enum ending */
    uint32_t report; /* enum fault that a monitor finds in this step */
    bool low, turns, stuck;
    bool gone; /* the bus has lost its master */
    uint32_t position;
    /* at the last judgement */
    uint32_t cause_before, shown_before, gates_before;
    bool cleared; /* since then the drive has been told to forget */
};

extern struct world world;

/* A slow loop's step with its millisecond, a round of the thread. */
void world_step(void);
void world_round(void);
void world_hardware(void);
void world_wrong(const char *what);

/* Whether a monitor that finds this cause looks now. */
bool world_has_sensor_for(int32_t cause);

#endif
